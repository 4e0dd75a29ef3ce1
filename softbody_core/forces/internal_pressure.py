"""Volume control: pressure on the inside of the wall (Mesit & Guha 2011, eq. 10)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np

from softbody_core.forces.volume_law import PressureLaw, Slopes, Volumes
from softbody_core.ground.parameters import Quantity
from softbody_core.state import Inputs
from softbody_core.weights import Control


@dataclass(frozen=True)
class InternalPressure(PressureLaw):
    """Gas pressure and driven pressure, along the outward area vectors.

    F_i = (κ N / B + ΔP) ∂V/∂x_i

    "I/B" has no I in the text of the paper; here the gas pressure is κN/B. The area share of a
    point is a third of each of its triangles, which makes F_i exactly the gradient of the volume.

    Parameters
    ----------
    gas_energy : float
        κ, energy per unit of N, J.
    over : {"bounding-box", "enclosed-volume"}
        Volume B that the gas fills: that of the axis-aligned bounding box, as in the paper, or the
        enclosed one. The box is not objective: it changes as a body turns.
    area_share : {"third", "whole"}
        ``"whole"`` is the literal reading of eq. 10 and pushes three times as hard.
    """

    control: ClassVar[Control | None] = Control.VOLUME

    gas_energy: Annotated[float, Quantity("J", at_least=0)]
    over: Literal["bounding-box", "enclosed-volume"] = "bounding-box"
    area_share: Literal["third", "whole"] = "third"

    @property
    def objective(self) -> bool:
        """Whether B turns with the body."""
        return self.over == "enclosed-volume"

    @property
    def share(self) -> float:
        """Area that a point feels, as a multiple of ∂V/∂x."""
        return 1.0 if self.area_share == "third" else 3.0

    def gas_volume(self, volumes: Volumes) -> float:
        """B, the volume that the gas fills, m³."""
        return volumes.volume if self.objective else volumes.bounding_box_volume

    def pressure(self, volumes: Volumes, inputs: Inputs) -> float:
        """κN/B + ΔP, Pa; without gas, nothing asks for B."""
        gas = self.gas_energy * inputs.n
        if gas == 0:
            return inputs.delta_p
        gas_volume = self.gas_volume(volumes)
        return gas / gas_volume + inputs.delta_p if gas_volume > 0 else np.inf

    def slopes(self, volumes: Volumes, inputs: Inputs) -> Slopes:
        """−κN/B²: the gas stiffens as it is squeezed."""
        gas = self.gas_energy * inputs.n
        if gas == 0:
            return Slopes()
        slope = -gas / self.gas_volume(volumes) ** 2
        return Slopes(volume=slope) if self.objective else Slopes(bounding_box_volume=slope)

    def potential(self, volumes: Volumes, inputs: Inputs) -> float | None:
        """−κN ln V − ΔP V, J; None for gas in a box, whose volume is not the one that it pushes."""
        driven = -inputs.delta_p * volumes.volume
        if inputs.n == 0:
            return driven
        if not self.objective:
            return None
        return float(-self.gas_energy * inputs.n * np.log(volumes.volume) + driven)
