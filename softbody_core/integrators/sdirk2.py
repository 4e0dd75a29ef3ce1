"""A two-stage, L-stable, singly diagonally implicit Runge-Kutta scheme of second order."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from softbody_core.errors import StepLimitError
from softbody_core.integrators.integrator import Stepper, Work
from softbody_core.integrators.quasi_newton import QuasiNewton
from softbody_core.model import SoftBodyModel
from softbody_core.parameters import Parameters, Quantity
from softbody_core.stability import check_finite, check_volume
from softbody_core.state import Inputs, State

Floats = NDArray[np.float64]

GAMMA: Final = 1 - 1 / math.sqrt(2)

# Weights at 0, γ and 1 that integrate quadratics exactly over a step.
_W0: Final = 1 / 2 - 1 / (6 * GAMMA)
_W1: Final = 1 / (6 * GAMMA * (1 - GAMMA))
_W2: Final = 1 - _W0 - _W1

_SMALLEST_SHARE: Final = 2.0**-20


@dataclass(frozen=True)
class SDIRK2(Parameters):
    """Second order with step size control (Alexander 1977; Hairer & Wanner 1996, IV.6).

    Inner steps are the communication step divided by a power of two. Each is two solutions of the
    implicit equation, with gas pressure and airway resistance implicit; the step is repeated with
    half its length if the error estimate exceeds the tolerance.

    Parameters
    ----------
    tolerance : float
        Error allowed in one step: of the volume over the rest volume, and of the points' positions
        (root mean square) over the radius of a ball of that volume.
    solver_accuracy : float
        Part of the tolerance to which each stage is solved.
    max_step : float, optional
        Largest inner step, s; by default the communication step.
    max_iterations : int
        Quasi-Newton iterations in one stage.
    """

    order: ClassVar[int] = 2

    tolerance: Annotated[float, Quantity("1", above=0)] = 1e-3
    solver_accuracy: Annotated[float, Quantity("1", above=0)] = 0.1
    max_step: Annotated[float | None, Quantity("s", above=0)] = None
    max_iterations: Annotated[int, Quantity("1", at_least=1)] = 12

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the scheme for one model."""
        return _SDIRK2(self, model)


class _SDIRK2(Stepper):
    def __init__(self, parameters: SDIRK2, model: SoftBodyModel) -> None:
        self.work = Work()
        self._parameters = parameters
        self._model = model
        self._solver = QuasiNewton(model, parameters.max_iterations, self.work)
        self._radius = float(np.cbrt(3 * model.mesh.volume / (4 * math.pi)))
        self._step = math.inf

    def memory(self) -> object:
        return self._step

    def recall(self, memory: object) -> None:
        self._step = float(memory)  # type: ignore[arg-type]

    def advance(self, state: State, inputs: Inputs, dt: float) -> State:
        end = state.time + dt
        share = self._first_share(dt)
        done = 0.0
        with np.errstate(all="ignore"):  # what overflows does not converge, or is found below
            while done < 1.0:
                tried = self._try(state, inputs, share * dt)
                if tried is None:
                    share /= 2
                    if share < _SMALLEST_SHARE:
                        raise StepLimitError(
                            f"at t = {state.time:.6g} s a step of {share * dt:.3g} s is still too "
                            f"long for tolerance = {self._parameters.tolerance:g}; try a larger "
                            "tolerance, an explicit integrator, or smaller inputs"
                        )
                    continue
                state, error = tried
                self.work.steps += 1
                done += share
                # Twice the step has eight times the error; it also has to end on its own grid.
                if error < 0.06 and share < self._largest_share(dt) and done % (2 * share) == 0:
                    share *= 2
        self._step = share * dt
        return State(end, state.positions, state.velocities)

    def _first_share(self, dt: float) -> float:
        share = self._largest_share(dt)
        while share * dt > self._step * (1 + 1e-9) and share > _SMALLEST_SHARE:
            share /= 2
        return share

    def _largest_share(self, dt: float) -> float:
        share, longest = 1.0, self._parameters.max_step
        while longest is not None and share * dt > longest * (1 + 1e-9):
            share /= 2
        return share

    def _try(self, state: State, inputs: Inputs, h: float) -> tuple[State, float] | None:
        """One step, with its error over the tolerance; None if it has to be shorter."""
        x, v, z = state.positions, state.velocities, GAMMA * h
        tolerance = self._parameters.tolerance
        accuracy = self._parameters.solver_accuracy * tolerance * self._radius
        first = self._solver.solve(x, v, v, z, inputs, accuracy)
        if not first.converged:
            return None
        v1 = first.velocities
        base = (1 - GAMMA) / GAMMA
        second = self._solver.solve(
            x + (1 - GAMMA) * h * v1, v + base * (v1 - v), v1, z, inputs, accuracy
        )
        if not second.converged:
            return None
        v2 = second.velocities
        # Positions by a third-order quadrature of the three velocities differ by the local error;
        # solving with the iteration matrix keeps a jump of the inputs, which the stiff parts follow
        # at once, from counting as one (Hosea & Shampine 1996).
        difference = h * (_W0 * v + (_W1 - (1 - GAMMA)) * v1 + (_W2 - GAMMA) * v2)
        linearization = self._solver.linearize(second.configuration, z, inputs)
        filtered = linearization.solve(self._model.masses * difference)
        volume = abs(float(np.vdot(second.configuration.volume_gradient, filtered)))
        distance = float(np.sqrt(np.mean(filtered**2) * 3))
        error = max(volume / self._model.mesh.volume, distance / self._radius) / tolerance
        if not error <= 1:
            return None
        reached = State(state.time + h, second.positions, v2)
        check_finite(reached)
        check_volume(reached.time, second.configuration)
        return reached, error
