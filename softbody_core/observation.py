"""What can be seen of a body from outside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softbody_core.ground.arrays import Floats
from softbody_core.state import RigidState


@dataclass(frozen=True)
class Observation:
    """What can be seen of a body from outside, in SI units.

    Attributes
    ----------
    time : float
        s.
    volume : float
        Enclosed volume, m³.
    bounding_box : ndarray, shape (2, 3)
        Lowest and highest corner, m.
    bounding_box_volume : float
        B, m³.
    pressure : float
        Driving pressure difference across the wall, γ (κN/B + ΔP), Pa.
    flow : float
        dV/dt, m³/s, positive while inhaling.
    alveolar_pressure : float
        `pressure` less R_aw · flow, Pa: what the tissue balances.
    clearance : float
        No point is nearer than this to an obstacle, m; positive as long as no point has ever passed
        one. Infinite in a scene without obstacles.
    obstacles : tuple of RigidState
        The rigid bodies of the scene.
    """

    time: float
    volume: float
    bounding_box: Floats
    bounding_box_volume: float
    pressure: float
    flow: float
    alveolar_pressure: float
    clearance: float = np.inf
    obstacles: tuple[RigidState, ...] = ()
