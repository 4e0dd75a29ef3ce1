"""Backward Euler: the slope of a step is that at its end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from softbody_core.integrators.implicit import ImplicitIntegrator, ImplicitStepper
from softbody_core.integrators.integrator import Stepper
from softbody_core.integrators.quasi_newton import Stage
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State


@dataclass(frozen=True)
class BackwardEuler(ImplicitIntegrator):
    """First order with step size control (Hairer & Wanner 1996, IV.3).

    One implicit equation a step. It damps every oscillation that it does not resolve, and none of
    its steps can blow up.
    """

    order: ClassVar[int | None] = 1

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the integrator for one model."""
        return _BackwardEuler(self, model)


class _BackwardEuler(ImplicitStepper):
    _doubling = 0.12  # the error is of second order, and this is half of a quarter

    def _try(self, state: State, inputs: Inputs, h: float) -> tuple[Stage, float] | None:
        return self._euler(state, inputs, h)
