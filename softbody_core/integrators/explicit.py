"""What explicit integrators share: equal substeps, as many as the stability limit asks for."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, NamedTuple, cast

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.errors import StepLimitError
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Quantity
from softbody_core.integrators.integrator import Counters, Integrator, Stepper
from softbody_core.model import SoftBodyModel
from softbody_core.stability import check_finite, check_volume, largest_stable_step
from softbody_core.state import Inputs, State

RECHECK = 64
"""Substeps after which the stability limit is estimated anew."""

SWOLLEN = 0.05
"""Relative change of the volume after which it is, too: the airway resists with area squared."""

Moment = tuple[Floats, Floats, Configuration]
"""Positions and velocities, and the configuration of those positions."""


@dataclass(frozen=True)
class ExplicitIntegrator(Integrator):
    """Parameters of every explicit integrator.

    Parameters
    ----------
    max_substep : float, optional
        Largest substep, s; by default the stability limit alone decides.
    safety : float
        Substep as a share of the estimated stability limit.
    max_substeps : int
        Substeps that one communication step may take.
    """

    max_substep: Annotated[float | None, Quantity("s", above=0)] = None
    safety: Annotated[float, Quantity("1", above=0)] = 0.9
    max_substeps: Annotated[int, Quantity("1", at_least=1)] = 200_000


class Estimate(NamedTuple):
    """Stability limit as it was last worked out: it serves short communication steps in a row.

    Attributes
    ----------
    limit : float
        Largest stable substep, s.
    inputs : Inputs
        Under which it holds.
    volume : float
        Enclosed volume at which it was worked out, m³.
    age : int
        Substeps taken since.
    """

    limit: float
    inputs: Inputs
    volume: float
    age: int = 0


class ExplicitStepper(Stepper):
    """Divides a communication step into stable substeps."""

    def __init__(self, parameters: ExplicitIntegrator, model: SoftBodyModel) -> None:
        self.counters = Counters()
        self._parameters = parameters
        self._model = model
        self._estimate: Estimate | None = None

    @abstractmethod
    def _march(self, state: State, inputs: Inputs, h: float) -> Iterator[Moment]:
        """Give the body after each of an endless row of substeps of length h."""

    def _acceleration(
        self, configuration: Configuration, velocities: Floats, inputs: Inputs
    ) -> Floats:
        """F_i/m_i of eq. 1, without what resists the flow, m/s²."""
        self.counters.force_evaluations += 1
        return self._model.acceleration(configuration, velocities, inputs)

    def _limit(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> float:
        """Largest stable substep, s."""
        return largest_stable_step(self._model.rates(configuration, velocities, inputs))

    def get_state(self) -> object:
        return self._estimate

    def set_state(self, state: object) -> None:
        self._estimate = cast("Estimate | None", state)

    def advance(self, state: State, inputs: Inputs, dt: float) -> State:
        end = state.time + dt
        taken_before = self.counters.steps
        remaining = 1.0  # share of dt, so that rounding cannot add or lose a substep
        while remaining > 0:
            with np.errstate(all="ignore"):  # what overflows is found here, and named
                estimate = self._estimate_at(state, inputs)
                allowed = self._parameters.max_substeps - (self.counters.steps - taken_before)
                needed = self._substeps_for(remaining * dt, estimate.limit, allowed)
                count = min(needed, RECHECK - estimate.age)
                h, time = remaining * dt / needed, state.time
                march = self._march(state, inputs, h)
                for taken, (x, v, configuration) in enumerate(march, start=1):
                    check_volume(time + taken * h, configuration)
                    swollen = abs(configuration.volume / estimate.volume - 1) > SWOLLEN
                    if taken == count or swollen:
                        state = State(time + taken * h, x, v)
                        break
                check_finite(state)
            self._estimate = None if swollen else estimate._replace(age=estimate.age + taken)
            self.counters.steps += taken
            remaining = 0.0 if taken == needed else remaining * (1 - taken / needed)
        return State(end, state.positions, state.velocities)

    def _estimate_at(self, state: State, inputs: Inputs) -> Estimate:
        """Last estimate, if it is young and of the same inputs; a new one otherwise."""
        last = self._estimate
        if last is not None and last.inputs == inputs and last.age < RECHECK:
            return last
        configuration = Configuration(self._model.mesh, state.positions)
        limit = self._limit(configuration, state.velocities, inputs)
        return Estimate(limit, inputs, configuration.volume)

    def _substeps_for(self, span: float, limit: float, allowed: int) -> int:
        parameters = self._parameters
        h = parameters.safety * limit
        if parameters.max_substep is not None:
            h = min(h, parameters.max_substep)
        needed = span / h if h > 0 else math.inf
        if not needed <= allowed:
            raise StepLimitError(
                f"{needed:.3g} substeps of {h:.3g} s are needed for the next {span:.3g} s, "
                f"more than max_substeps = {parameters.max_substeps} allows; try a shorter "
                "communication step, more mass, or less of what makes the body move fast "
                "(stiffness, damping, viscosity, resistance, pressure)"
            )
        return max(1, math.ceil(needed * (1 - 1e-12)))


def kick(
    model: SoftBodyModel,
    configuration: Configuration,
    velocities: Floats,
    acceleration: Floats,
    h: float,
) -> Floats:
    """Velocities after h under a constant acceleration and what resists the flow.

    Solves dv/dt = a − R M⁻¹A (A·v), A = ∂V/∂x, exactly at fixed positions where R is a constant.
    Resistance has rank one, so the flow A·v obeys one equation of rate λ = R A·M⁻¹A; however large
    λh is, the flow goes to the one at which resistance balances the other forces. An R that depends
    on the flow is that of the flow halfway.
    """
    changed = velocities + h * acceleration
    if not model.resistances:
        return changed
    gradient = configuration.volume_gradient
    direction = gradient * model.inverse_masses
    mobility = float(np.vdot(gradient, direction))
    if mobility == 0:
        return changed
    flow = float(np.vdot(gradient, velocities))
    drive = float(np.vdot(gradient, acceleration))
    rate = model.resistance(flow) * mobility
    halfway = flow + h / 2 * drive - _lost_flow(flow, drive, rate, h / 2)
    rate = model.resistance(halfway) * mobility
    changed -= (_lost_flow(flow, drive, rate, h) / mobility) * direction
    return changed


def _lost_flow(flow: float, drive: float, rate: float, h: float) -> float:
    """Flow that resistance takes within h from one that is driven: dQ/dt = drive − rate Q."""
    if rate == 0:
        return 0.0
    decayed = -math.expm1(-rate * h)
    return flow * decayed + drive * (h - decayed / rate)
