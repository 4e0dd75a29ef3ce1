"""The two-step backward differentiation formula, with variable steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from softbody_core.integrators.implicit import ImplicitIntegrator, ImplicitStepper
from softbody_core.integrators.integrator import Stepper
from softbody_core.integrators.quasi_newton import Stage
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State

_MILNE = 8 / 23
"""Error of the formula over its difference from the second-order Adams-Bashforth formula."""


@dataclass(frozen=True)
class BDF2(ImplicitIntegrator):
    """Second order with step size control (Hairer, Nørsett & Wanner 1993, III.5).

    One implicit equation a step, half of what `SDIRK2` needs. A step builds on the one before, so
    the integrator starts again, with a step of backward Euler, whenever the inputs jump: it suits
    long communication steps and inputs that stay.
    """

    order: ClassVar[int | None] = 2

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the integrator for one model."""
        return _BDF2(self, model)


class _BDF2(ImplicitStepper):
    _doubling = 0.06  # the error is of third order, and this is half of an eighth

    def _try(self, state: State, inputs: Inputs, h: float) -> tuple[Stage, float] | None:
        past = self._before(state, inputs)
        if past is None:
            return self._euler(state, inputs, h)
        x, v = state.positions, state.velocities
        before, ratio = past.start, h / past.h
        carried = ratio**2 / (1 + 2 * ratio)
        z = h * (1 + ratio) / (1 + 2 * ratio)
        linearization = self._solver.linearize(x + z * v, v, z, inputs)
        stage = self._solver.solve(
            x + carried * (x - before.positions),
            v + carried * (v - before.velocities),
            v + ratio * (v - before.velocities),
            linearization,
            inputs,
            self._accuracy,
        )
        if not stage.converged:
            return None
        explicit = x + h * ((1 + ratio / 2) * v - ratio / 2 * before.velocities)
        difference = _MILNE * (stage.positions - explicit)
        return stage, self._error(difference, linearization, stage, smooth=True)
