"""What implicit integrators share: inner steps that halve and double under an error estimate."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, Final, NamedTuple, cast

import numpy as np

from softbody_core.errors import StepLimitError
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Quantity
from softbody_core.integrators.integrator import Counters, Integrator, Stepper
from softbody_core.integrators.quasi_newton import Linearization, QuasiNewton, Stage
from softbody_core.model import SoftBodyModel
from softbody_core.stability import check_finite, check_volume
from softbody_core.state import Inputs, State

_SMALLEST_SHARE: Final = 2.0**-30
_LONGEST_WAIT: Final = 64


@dataclass(frozen=True)
class ImplicitIntegrator(Integrator):
    """Parameters of every implicit integrator.

    Parameters
    ----------
    tolerance : float
        Error allowed in one step: of the volume over the rest volume, and of the points' positions
        (root mean square) over the radius of a ball of that volume.
    solver_accuracy : float
        Part of the tolerance to which each implicit equation is solved.
    max_step : float, optional
        Largest inner step, s; by default the communication step.
    max_iterations : int
        Quasi-Newton iterations in one implicit equation.
    max_steps : int
        Inner steps, failed ones included, that one communication step may take.
    """

    tolerance: Annotated[float, Quantity("1", above=0)] = 1e-3
    solver_accuracy: Annotated[float, Quantity("1", above=0)] = 0.01
    max_step: Annotated[float | None, Quantity("s", above=0)] = None
    max_iterations: Annotated[int, Quantity("1", at_least=1)] = 20
    max_steps: Annotated[int, Quantity("1", at_least=1)] = 10_000


class AcceptedStep(NamedTuple):
    """A step that was taken: where it started and ended, its length, and its inputs."""

    start: State
    end: State
    h: float
    inputs: Inputs


class ImplicitStepper(Stepper):
    """Carries a body over a communication step in inner steps of 1, ½, ¼, … of its length.

    A step whose equations do not converge, or whose error exceeds the tolerance, is taken again
    with half its length.
    """

    _doubling: float
    """Error over tolerance below which a step of twice the length should pass."""

    def __init__(self, parameters: ImplicitIntegrator, model: SoftBodyModel) -> None:
        self.counters = Counters()
        self._parameters = parameters
        self._model = model
        self._solver = QuasiNewton(model, parameters.max_iterations, self.counters)
        self._radius = model.mesh.radius
        self._accuracy = parameters.solver_accuracy * parameters.tolerance * self._radius
        self._step = math.inf
        self._last: AcceptedStep | None = None

    @abstractmethod
    def _try(self, state: State, inputs: Inputs, h: float) -> tuple[Stage, float] | None:
        """One step, with its error over the tolerance; None if an equation does not converge."""

    def get_state(self) -> object:
        return self._step, self._last

    def set_state(self, state: object) -> None:
        self._step, self._last = cast("tuple[float, AcceptedStep | None]", state)

    def advance(self, state: State, inputs: Inputs, dt: float) -> State:
        end, share, done = state.time + dt, self._first_share(dt), 0.0
        wait, waiting, tries = 1, 0, 0
        with np.errstate(all="ignore"):  # what overflows does not converge, or is found below
            while done < 1.0:
                tries += 1
                if tries > self._parameters.max_steps or share < _SMALLEST_SHARE:
                    raise StepLimitError(self._too_long(state.time, share * dt, tries - 1))
                tried = self._try(state, inputs, share * dt)
                if tried is None or not tried[1] <= 1:
                    share, waiting, wait = share / 2, wait, min(2 * wait, _LONGEST_WAIT)
                    continue
                state = self._accept(state, inputs, share * dt, tried[0])
                done += share
                waiting -= 1
                small = tried[1] < self._doubling and share < self._largest_share(dt)
                if small and waiting <= 0 and done % (2 * share) == 0:  # it ends on its own grid
                    share *= 2
        self._step = share * dt
        return State(end, state.positions, state.velocities)

    def _accept(self, state: State, inputs: Inputs, h: float, stage: Stage) -> State:
        reached = State(state.time + h, stage.positions, stage.velocities)
        check_finite(reached)
        check_volume(reached.time, stage.configuration)
        self.counters.steps += 1
        self._last = AcceptedStep(state, reached, h, inputs)
        return reached

    def _before(self, state: State, inputs: Inputs) -> AcceptedStep | None:
        """Step that led to a state, if the inputs have not jumped since."""
        last = self._last
        if last is None or last.inputs != inputs or last.end.positions is not state.positions:
            return None
        return last

    def _euler(self, state: State, inputs: Inputs, h: float) -> tuple[Stage, float] | None:
        """Take a step of backward Euler; the trapezoidal rule tells its error."""
        x, v = state.positions, state.velocities
        linearization = self._solver.linearize(x + h * v, v, h, inputs)
        stage = self._solver.solve(x, v, v, linearization, inputs, self._accuracy)
        if not stage.converged:
            return None
        difference = 0.5 * h * (stage.velocities - v)
        smooth = self._before(state, inputs) is not None
        return stage, self._error(difference, linearization, stage, smooth)

    def _error(
        self, difference: Floats, linearization: Linearization, stage: Stage, smooth: bool
    ) -> float:
        """Error over the tolerance, from two solutions' difference in the positions, m.

        Solving with the iteration matrix keeps a jump of the inputs, which the stiff parts follow
        at once, from counting as an error (Hosea & Shampine 1996). Without a jump, the volume needs
        no such filter, which would take its slow part for a stiff one.
        """
        filtered = linearization.solve(self._model.masses * difference)
        moved = difference if smooth else filtered
        volume = abs(float(np.vdot(stage.configuration.volume_gradient, moved)))
        distance = float(np.sqrt(np.mean(filtered**2) * 3))
        largest = max(volume / self._model.mesh.volume, distance / self._radius)
        return largest / self._parameters.tolerance

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

    def _too_long(self, time: float, h: float, tries: int) -> str:
        return (
            f"at t = {time:.6g} s, after {tries} inner steps of this communication step, a step of "
            f"{h:.3g} s is still too long for tolerance = {self._parameters.tolerance:g}; try a "
            "larger tolerance, less damping or viscosity, smaller inputs, or an explicit integrator"
        )
