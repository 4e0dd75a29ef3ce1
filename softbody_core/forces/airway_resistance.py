"""Airway resistance: flow through the airway costs wall pressure.

Not in the paper's equations, but its Figures 8 to 11 need it: only a resistance makes a soft lung
slow to return to its volume, since the damping of eq. 4 scales with α as the springs do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.forces.force import BoundForce, RankOne, Rates, Tangent
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.mesh import SurfaceMesh
from softbody_core.state import Inputs
from softbody_core.weights import Control


@dataclass(frozen=True)
class AirwayResistance(Parameters):
    """Pressure drop proportional to flow.

    F_i = −R_aw (dV/dt) ∂V/∂x_i with dV/dt = Σ_i ∂V/∂x_i · v_i

    The law carries no weight of eq. 1: it belongs to the airway, not to the tissue or the gas.

    Parameters
    ----------
    resistance : float
        R_aw, Pa·s/m³ (1 cmH2O·s/L is 98 066.5 Pa·s/m³).
    """

    control: ClassVar[Control | None] = None

    resistance: Annotated[float, Quantity("Pa.s/m^3", at_least=0)]

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundResistance:
        """Put the airway on the surface."""
        return BoundResistance(self, masses)


class BoundResistance(BoundForce):
    """Airway of one body."""

    def __init__(self, law: AirwayResistance, masses: Floats) -> None:
        self.law = law
        self._masses = masses

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        gradient = configuration.volume_gradient
        flow = float(np.vdot(gradient, velocities))
        return (-self.law.resistance * flow) * gradient

    def damping(self, configuration: Configuration) -> Tangent:
        return Tangent(rank_one=self.rank_one_damping(configuration))

    def rank_one_damping(self, configuration: Configuration) -> tuple[RankOne, ...]:
        gradient = configuration.volume_gradient
        return (RankOne(self.law.resistance, gradient, gradient),)

    def rates(self, configuration: Configuration, inputs: Inputs) -> Rates:
        gradient = configuration.volume_gradient
        mobility = float(np.vdot(gradient, gradient / self._masses))
        return Rates(damping=self.law.resistance * mobility)
