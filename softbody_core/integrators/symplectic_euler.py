"""Symplectic Euler: velocities first, then positions with the new velocities."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from softbody_core.configuration import Configuration
from softbody_core.integrators.explicit import ExplicitParameters, ExplicitStepper, Moment, kick
from softbody_core.integrators.integrator import Stepper
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State


@dataclass(frozen=True)
class SymplecticEuler(ExplicitParameters):
    """First order, one force evaluation a substep (Hairer, Lubich & Wanner 2006, section I.1)."""

    order: ClassVar[int | None] = 1

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the scheme for one model."""
        return _SymplecticEuler(self, model)


class _SymplecticEuler(ExplicitStepper):
    def _march(self, state: State, inputs: Inputs, h: float) -> Iterator[Moment]:
        model, x, v = self._model, state.positions, state.velocities
        here = Configuration(model.mesh, x)
        while True:
            v = kick(model, here, v, self._acceleration(here, v, inputs), h)
            x = x + h * v
            here.move_to(x)
            yield x, v, here
