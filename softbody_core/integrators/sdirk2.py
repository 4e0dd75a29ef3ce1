"""A two-stage, L-stable, singly diagonally implicit Runge-Kutta scheme of second order."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from softbody_core.integrators.implicit import ImplicitIntegrator, ImplicitStepper
from softbody_core.integrators.integrator import Stepper
from softbody_core.integrators.quasi_newton import Stage
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State

GAMMA: Final = 1 - 1 / math.sqrt(2)

# Weights at 0, γ and 1 that integrate quadratics exactly over a step.
_W0: Final = 1 / 2 - 1 / (6 * GAMMA)
_W1: Final = 1 / (6 * GAMMA * (1 - GAMMA))
_W2: Final = 1 - _W0 - _W1

_QUADRATURE: Final = 1 / 0.147

_BEND: Final = 12
"""h³V‴ over the local error, 1/0.04, times the square of the stages' distance, ½."""


@dataclass(frozen=True)
class SDIRK2(ImplicitIntegrator):
    """Second order with step size control (Alexander 1977; Hairer & Wanner 1996, IV.6).

    A step is two implicit equations, with gas pressure and airway resistance implicit. It starts
    afresh from the state alone, so it suits inputs that jump at every communication point.
    """

    order: ClassVar[int | None] = 2

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the integrator for one model."""
        return _SDIRK2(self, model)


class _SDIRK2(ImplicitStepper):
    _doubling = 0.06  # the error is of third order, and this is half of an eighth

    def _try(self, state: State, inputs: Inputs, h: float) -> tuple[Stage, float] | None:
        x, v, z = state.positions, state.velocities, GAMMA * h
        linearization = self._solver.linearize(x + z * v, v, z, inputs)
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
        # Positions by a third-order quadrature of the three velocities differ by a part of the
        # local error: for y' = λy, the errors of the stages themselves leave 0.147 of it.
        v2 = second.velocities
        difference = _QUADRATURE * h * (_W0 * v + (_W1 - (1 - GAMMA)) * v1 + (_W2 - GAMMA) * v2)
        smooth = self._before(state, inputs) is not None
        error = self._error(difference, linearization, second, smooth)
        if smooth:
            return second, error
        gradient = second.configuration.volume_gradient
        early, late = float(np.vdot(gradient, v1)), float(np.vdot(gradient, v2))
        return second, max(error, self._bend(early, late, h))

    def _bend(self, early: float, late: float, h: float) -> float:
        """Error of the volume over the tolerance, from the flows of the two stages, m³/s.

        After a jump of the inputs, nothing is known of the slope at the start. If the flow decays
        like exp(−λt), the third derivative of the volume is (late − early)²/(flow h²), nearly.
        """
        flow = max(abs(early), abs(late))
        bend = 0.0 if flow == 0 else h * (late - early) ** 2 / (_BEND * flow)
        return bend / (self._model.mesh.volume * self._parameters.tolerance)
