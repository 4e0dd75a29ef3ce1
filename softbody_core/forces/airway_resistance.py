"""Airway resistance: flow through the airway costs wall pressure.

Not in the paper's equations, but its Figures 8 to 11 need it: only a resistance makes a soft lung
slow to return to its volume, since the damping of eq. 4 scales with α as the springs do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from softbody_core.forces.volume_law import ResistanceLaw
from softbody_core.ground.parameters import Quantity


@dataclass(frozen=True)
class AirwayResistance(ResistanceLaw):
    """Pressure drop proportional to flow.

    F_i = −R_aw (dV/dt) ∂V/∂x_i with dV/dt = Σ_i ∂V/∂x_i · v_i

    The law carries no weight of eq. 1: it belongs to the airway, not to the tissue or the gas.

    Parameters
    ----------
    resistance : float
        R_aw, Pa·s/m³ (1 cmH2O·s/L is 98 066.5 Pa·s/m³).
    """

    resistance: Annotated[float, Quantity("Pa.s/m^3", at_least=0)]

    @property
    def acts(self) -> bool:
        """False for an open airway."""
        return self.resistance > 0

    def resistance_at(self, flow: float) -> float:
        """R_aw, whatever the flow."""
        return self.resistance
