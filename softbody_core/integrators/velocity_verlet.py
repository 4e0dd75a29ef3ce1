"""Velocity Verlet: half a kick, a drift, half a kick."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from softbody_core.configuration import Configuration
from softbody_core.forces import Rates
from softbody_core.ground.arrays import Floats
from softbody_core.integrators.explicit import ExplicitIntegrator, ExplicitStepper, Moment, kick
from softbody_core.integrators.integrator import Stepper
from softbody_core.model import SoftBodyModel
from softbody_core.stability import largest_stable_step
from softbody_core.state import Inputs, State


@dataclass(frozen=True)
class VelocityVerlet(ExplicitIntegrator):
    """Second order, one force evaluation a substep (Hairer, Lubich & Wanner 2006, section I.1).

    Damping depends on the velocity at the end of the substep, which is predicted with the force at
    its start; that keeps the second order.
    """

    order: ClassVar[int | None] = 2
    stability_limit: ClassVar[float] = 2.0

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the integrator for one model."""
        return _VelocityVerlet(self, model)


class _VelocityVerlet(ExplicitStepper):
    def _limit(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> float:
        # The predicted velocity makes it stable while h²ω² + 4hc ≤ 4.
        stiffness, damping = self._model.rates(configuration, velocities, inputs)
        return largest_stable_step(Rates(stiffness, 2 * damping))

    def _march(self, state: State, inputs: Inputs, h: float) -> Iterator[Moment]:
        model, x, v = self._model, state.positions, state.velocities
        configuration = Configuration(model.mesh, x)
        acceleration = self._acceleration(configuration, v, inputs)
        while True:
            v = kick(model, configuration, v, acceleration, h / 2)
            x = x + h * v
            predicted = kick(model, configuration, v, acceleration, h / 2)
            configuration.move_to(x)
            acceleration = self._acceleration(configuration, predicted, inputs)
            v = kick(model, configuration, v, acceleration, h / 2)
            yield x, v, configuration
