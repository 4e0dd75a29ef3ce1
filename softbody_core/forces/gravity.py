"""Gravity (Mesit & Guha 2011, eq. 11)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.forces.force import BoundForce
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.mesh import SurfaceMesh
from softbody_core.state import Inputs
from softbody_core.weights import Control

STANDARD_GRAVITY = 9.80665
"""Acceleration of free fall, m/s² (3rd CGPM, 1901)."""


@dataclass(frozen=True)
class Gravity(Parameters):
    """Weight of each point along −z: F_i = m_i g.

    Parameters
    ----------
    acceleration : float
        |g|, m/s².
    """

    control: ClassVar[Control | None] = Control.GRAVITY

    acceleration: Annotated[float, Quantity("m/s^2", at_least=0)] = STANDARD_GRAVITY

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundForce:
        """Weigh the points."""
        return _BoundGravity(self.acceleration * masses)


class _BoundGravity(BoundForce):
    def __init__(self, weights: Floats) -> None:
        self._weights = weights
        self._force = np.zeros((3, len(weights)))
        self._force[2] = -weights

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        return self._force

    def energy(self, configuration: Configuration, inputs: Inputs) -> float:
        return float(self._weights @ configuration.positions[2])
