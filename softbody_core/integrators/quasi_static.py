"""Slow breathing: the body is in equilibrium at every moment, and only its volume has a history."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, cast

import numpy as np
from scipy.optimize import brentq

from softbody_core.configuration import Configuration
from softbody_core.errors import DivergenceError
from softbody_core.ground.parameters import Quantity
from softbody_core.integrators.equilibrium_path import EquilibriumPath, PathState
from softbody_core.integrators.equilibrium_solver import Balance, EquilibriumSolver
from softbody_core.integrators.integrator import Counters, Integrator, Stepper
from softbody_core.model import SoftBodyModel
from softbody_core.stability import CALMER, LARGEST_VOLUME_RATIO, check_finite, diverged_volume
from softbody_core.state import Inputs, State

_RESOLVED = 0.05
"""Largest substep of the volume's equation times its rate; slopes jump from point to point."""
_EXACT = 1e-12
"""Relative accuracy of a volume at equilibrium."""
_MOST_SUBSTEPS = 500
"""A volume whose rate asks for more reaches its equilibrium within the step."""
_NUDGE = 1e-4
"""Relative change of the volume that shows the rate of its flow."""
_LOOK_AHEAD = 0.05
"""Logarithm of the volume ratio at which the next equilibrium is looked for."""


@dataclass(frozen=True)
class QuasiStatic(Integrator):
    """Equilibrium at each communication point; the inertia of the body is neglected.

    The shape is the one in which internal forces balance the pressure, at the volume that the body
    has. The volume follows from the flow that resistance lets through,

    (R + R_tissue) dV/dt = p − p_el(V),

    or, where nothing resists, from p = p_el(V). The pressure p is that of all laws along ∂V/∂x,
    such as γ(κN/B + ΔP), and R is what resists the flow. Shapes and recoil p_el(V) are worked out
    as the volume first gets there, and again where it turns back (`EquilibriumPath`). Whatever the
    body's shape and velocity were before, it is in equilibrium after the first step.

    For breathing that is slow beside the body's own oscillations. There is no order: as the step
    shrinks, results converge to the body without mass.

    Parameters
    ----------
    spacing : float
        Logarithm of the ratio of neighbouring volumes at which a shape is worked out.
    tolerance : float
        Accuracy of the recoil, over that of a doubled volume (see `EquilibriumSolver`).
    max_iterations : int
        Iterations for one shape.
    """

    order: ClassVar[int | None] = None

    spacing: Annotated[float, Quantity("1", above=0)] = 0.05
    tolerance: Annotated[float, Quantity("1", above=0)] = 1e-5
    max_iterations: Annotated[int, Quantity("1", at_least=1)] = 12

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the integrator for one model."""
        return _QuasiStatic(self, model)


class _QuasiStatic(Stepper):
    def __init__(self, parameters: QuasiStatic, model: SoftBodyModel) -> None:
        self.counters = Counters()
        self._model = model
        solver = EquilibriumSolver(
            model,
            parameters.spacing,
            parameters.tolerance,
            parameters.max_iterations,
            self.counters,
        )
        self._path = EquilibriumPath(solver)
        self._reached: tuple[State, float] | None = None

    def get_state(self) -> object:
        return self._path.get_state(), self._reached

    def set_state(self, state: object) -> None:
        path, self._reached = cast("tuple[PathState, tuple[State, float] | None]", state)
        self._path.set_state(path)

    def advance(self, state: State, inputs: Inputs, dt: float) -> State:
        with np.errstate(all="ignore"):  # what overflows is found, and named
            start = self._volume(state)
            slow = _SlowVolume(self._model, self._path, inputs, state.time)
            end, flow = slow.advance(start, dt)
            positions, slope = self._path.shape(end)
        self.counters.steps += 1
        reached = State(state.time + dt, positions, flow * slope)
        check_finite(reached)
        self._reached = reached, end
        return reached

    def _volume(self, state: State) -> float:
        """Volume of a state, m³, without the curve's interpolation error if it came from here."""
        if self._reached is not None and state is self._reached[0]:
            return self._reached[1]
        return Configuration(self._model.mesh, state.positions).volume


@dataclass(frozen=True)
class _SlowVolume:
    """The equation of the volume, under inputs that are held."""

    model: SoftBodyModel
    path: EquilibriumPath
    inputs: Inputs
    time: float

    def advance(self, volume: float, dt: float) -> tuple[float, float]:
        """Volume, m³, and flow, m³/s, after dt: Runge-Kutta of fourth order in resolved steps."""
        remaining = dt
        while remaining > 0:
            flow, rate = self._flow_and_rate(volume)
            if -rate * remaining > _RESOLVED * _MOST_SUBSTEPS:
                end = self._equilibrium(volume)
                self.path.go_to(end)
                return end, (end - volume) / dt
            h = min(remaining, _RESOLVED / max(abs(rate), abs(flow) / volume, 1e-300))
            k2 = self._flow(volume + 0.5 * h * flow)
            k3 = self._flow(volume + 0.5 * h * k2)
            k4 = self._flow(volume + h * k3)
            volume += h / 6 * (flow + 2 * k2 + 2 * k3 + k4)
            self.path.go_to(volume)
            remaining = remaining - h if h < remaining else 0.0
        return volume, self._flow(volume)

    def _flow_and_rate(self, volume: float) -> tuple[float, float]:
        """dV/dt, m³/s, and its rate, 1/s, at this resistance; −∞ where nothing resists."""
        drive, drag = self._drive_and_drag(volume)
        if self.model.resistance(math.copysign(volume, drive)) + drag <= 0:
            return 0.0, -math.inf
        flow = self.model.driven_flow(drive, drag)
        resistance = self.model.differential_resistance(flow) + drag
        ahead, _ = self._drive_and_drag(volume * (1 + _NUDGE))
        return flow, (ahead - drive) / (volume * _NUDGE * resistance)

    def _flow(self, volume: float) -> float:
        return self.model.driven_flow(*self._drive_and_drag(volume))

    def _drive_and_drag(self, volume: float) -> tuple[float, float]:
        """Pressure that is left when the recoil is balanced, Pa, and the drag, Pa·s/m³."""
        balance = self._balance(volume)
        return self.model.load(balance, self.inputs) - balance.recoil, balance.drag

    def _equilibrium(self, volume: float) -> float:
        """Nearest volume at which nothing flows, in the direction of the drive."""

        def drive_at(volume: float) -> float:
            return self._drive_and_drag(volume)[0]

        drive = drive_at(volume)
        step, ahead = math.exp(math.copysign(_LOOK_AHEAD, drive)), volume
        while drive_at(ahead) * drive > 0:
            volume, ahead = ahead, ahead * step
        return (
            float(brentq(drive_at, volume, ahead, xtol=_EXACT * volume))
            if ahead != volume
            else volume
        )

    def _balance(self, volume: float) -> Balance:
        ratio = volume / self.model.mesh.volume
        if not 1 / LARGEST_VOLUME_RATIO <= ratio <= LARGEST_VOLUME_RATIO:
            raise diverged_volume(self.time, ratio)
        balance = self.path.balance(volume)
        if not math.isfinite(sum(balance)):
            raise DivergenceError(self.time, "the recoil", balance.recoil, CALMER)
        return balance
