"""A two-stage, L-stable, singly diagonally implicit Runge-Kutta scheme of second order."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Final

from softbody_core.integrators.implicit import ImplicitParameters, ImplicitStepper
from softbody_core.integrators.integrator import Stepper
from softbody_core.integrators.quasi_newton import Stage
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State

GAMMA: Final = 1 - 1 / math.sqrt(2)

# Weights at 0, γ and 1 that integrate quadratics exactly over a step.
_W0: Final = 1 / 2 - 1 / (6 * GAMMA)
_W1: Final = 1 / (6 * GAMMA * (1 - GAMMA))
_W2: Final = 1 - _W0 - _W1


@dataclass(frozen=True)
class SDIRK2(ImplicitParameters):
    """Second order with step size control (Alexander 1977; Hairer & Wanner 1996, IV.6).

    A step is two implicit equations, with gas pressure and airway resistance implicit. It starts
    afresh from the state alone, so it suits inputs that jump at every communication point.
    """

    order: ClassVar[int | None] = 2

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the scheme for one model."""
        return _SDIRK2(self, model)


class _SDIRK2(ImplicitStepper):
    _doubling = 0.06  # the error is of third order, and this is half of an eighth

    def _try(self, state: State, inputs: Inputs, h: float) -> tuple[Stage, float] | None:
        x, v, z = state.positions, state.velocities, GAMMA * h
        linearization = self._solver.linearize(x + z * v, z, inputs)
        first = self._solver.solve(x, v, v, linearization, inputs, self._accuracy)
        if not first.converged:
            return None
        v1 = first.velocities
        base = (1 - GAMMA) / GAMMA
        second = self._solver.solve(
            x + (1 - GAMMA) * h * v1,
            v + base * (v1 - v),
            v1,
            linearization,
            inputs,
            self._accuracy,
        )
        if not second.converged:
            return None
        # Positions by a third-order quadrature of the three velocities differ by the local error.
        v2 = second.velocities
        difference = h * (_W0 * v + (_W1 - (1 - GAMMA)) * v1 + (_W2 - GAMMA) * v2)
        return second, self._error(difference, linearization, second)
