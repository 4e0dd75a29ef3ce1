"""Gravity (Mesit & Guha 2011, eq. 11)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.forces.law import BoundLaw, Law
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Quantity
from softbody_core.mesh import SurfaceMesh
from softbody_core.state import Inputs
from softbody_core.weights import Control

STANDARD_GRAVITY = 9.80665
"""Acceleration of free fall, m/s² (3rd CGPM, 1901)."""


@dataclass(frozen=True)
class Gravity(Law):
    """Weight of each point along −z: F_i = m_i g.

    Parameters
    ----------
    acceleration : float
        |g|, m/s².
    """

    control: ClassVar[Control | None] = Control.GRAVITY
    acts_at_rest, internal, objective = True, False, False

    acceleration: Annotated[float, Quantity("m/s^2", at_least=0)] = STANDARD_GRAVITY

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundLaw[Law]:
        """Weigh the points."""
        return _BoundGravity(self, mesh, masses)


class _BoundGravity(BoundLaw[Gravity]):
    @cached_property
    def _weights(self) -> Floats:
        return np.outer((0.0, 0.0, -self.law.acceleration), self.masses)

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        return self._weights

    def energy(self, configuration: Configuration, inputs: Inputs) -> float:
        return -float(np.vdot(self._weights, configuration.positions))
