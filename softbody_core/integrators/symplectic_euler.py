"""Symplectic Euler: velocities first, then positions with the new velocities."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from softbody_core.configuration import Configuration
from softbody_core.integrators.explicit import ExplicitIntegrator, ExplicitStepper, Moment, kick
from softbody_core.integrators.integrator import Stepper
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State


@dataclass(frozen=True)
class SymplecticEuler(ExplicitIntegrator):
    """First order, one force evaluation a substep (Hairer, Lubich & Wanner 2006, section I.1)."""

    order: ClassVar[int | None] = 1
    stability_limit: ClassVar[float] = 2.0

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the integrator for one model."""
        return _SymplecticEuler(self, model)


class _SymplecticEuler(ExplicitStepper):
    def _march(self, state: State, inputs: Inputs, h: float) -> Iterator[Moment]:
        model, x, v = self._model, state.positions, state.velocities
        configuration = Configuration(model.mesh, x)
        while True:
            acceleration = self._acceleration(configuration, v, inputs)
            v = kick(model, configuration, v, acceleration, h)
            x = x + h * v
            configuration.move_to(x)
            yield x, v, configuration
