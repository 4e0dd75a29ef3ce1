"""The classical Runge-Kutta scheme of fourth order."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.ground.arrays import Floats
from softbody_core.integrators.explicit import ExplicitIntegrator, ExplicitStepper, Moment
from softbody_core.integrators.integrator import Stepper
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State

STABLE_RADIUS = 2.6
"""The stability region holds the left half of a disc of this radius (its edge is at 2.615)."""


_OVERSHOOT = 2.0
"""Flow, over the one at which resistance balances the forces, that inertia may lead to."""


@dataclass(frozen=True)
class RK4(ExplicitIntegrator):
    """Fourth order, four force evaluations a substep (Hairer, Nørsett & Wanner 1993, II.1).

    What resists the flow is explicit here, so a large resistance makes substeps small.
    """

    order: ClassVar[int | None] = 4
    stability_limit: ClassVar[float] = math.sqrt(8)

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the integrator for one model."""
        return _RK4(self, model)


class _RK4(ExplicitStepper):
    def _limit(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> float:
        stiffness, damping = self._model.rates(configuration, velocities, inputs)
        if self._model.resistances:
            damping += self._resistance_rate(configuration, velocities, inputs)
        # The eigenvalues −c/2 ± √(c²/4 − ω²) have modulus ω, or no more than c where overdamped.
        largest = max(math.sqrt(stiffness), damping)
        return math.inf if largest == 0 else STABLE_RADIUS / largest

    def _resistance_rate(
        self, configuration: Configuration, velocities: Floats, inputs: Inputs
    ) -> float:
        """Bound of d(RQ)/dQ A·M⁻¹A, 1/s, at the flow and at the one that the forces drive."""
        model, gradient = self._model, configuration.volume_gradient
        mobility = float(np.vdot(gradient, gradient / model.masses))
        flows = [float(np.vdot(gradient, velocities))]
        if any(bound.law.follows_flow for _, bound in model.resistances):
            drive = float(np.vdot(gradient, self._acceleration(configuration, velocities, inputs)))
            flows.append(_OVERSHOOT * model.driven_flow(drive / mobility))
        return max(model.differential_resistance(flow) * mobility for flow in flows)

    def _march(self, state: State, inputs: Inputs, h: float) -> Iterator[Moment]:
        x, v = state.positions, state.velocities
        configuration = Configuration(self._model.mesh, x)

        def acceleration(x: Floats, v: Floats) -> Floats:
            if configuration.positions is not x:
                configuration.move_to(x)
            self.counters.force_evaluations += 1
            force = self._model.total_force(configuration, v, inputs)
            return self._model.inverse_masses * force

        while True:
            a1 = acceleration(x, v)
            v2 = v + 0.5 * h * a1
            a2 = acceleration(x + 0.5 * h * v, v2)
            v3 = v + 0.5 * h * a2
            a3 = acceleration(x + 0.5 * h * v2, v3)
            v4 = v + h * a3
            a4 = acceleration(x + h * v3, v4)
            x = x + h / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            configuration.move_to(x)
            yield x, v, configuration
