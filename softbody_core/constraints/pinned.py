"""Points that are held where they rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from softbody_core.constraints.constraint import Constraint
from softbody_core.ground.arrays import Booleans
from softbody_core.ground.errors import ParameterError
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.mesh import SurfaceMesh


@dataclass(frozen=True)
class PinnedPoints(Constraint):
    """Points held by index.

    Parameters
    ----------
    indices : tuple of int
        The points.
    """

    indices: tuple[int, ...]

    def held(self, mesh: SurfaceMesh) -> Booleans:
        """Return True for each pinned point."""
        if not all(isinstance(i, int | np.integer) for i in self.indices):
            raise ParameterError(f"PinnedPoints: indices = {self.indices}: expected whole numbers")
        outside = [i for i in self.indices if not 0 <= i < mesh.n_points]
        if outside:
            raise ParameterError(
                f"PinnedPoints: point {outside[0]} does not exist; "
                f"the mesh has points 0 … {mesh.n_points - 1}"
            )
        held = np.zeros(mesh.n_points, dtype=np.bool_)
        held[list(self.indices)] = True
        return held


@dataclass(frozen=True)
class PinnedTop(Parameters, Constraint):
    """The highest points, as a lung hangs from its apex.

    Parameters
    ----------
    share : float
        Part of all points that is held; at least one point is.
    """

    share: Annotated[float, Quantity("1", above=0)] = 0.015

    def held(self, mesh: SurfaceMesh) -> Booleans:
        """Return True for each of the highest points."""
        if self.share >= 1:
            raise ParameterError(
                f"PinnedTop.share = {self.share:g}: expected less than 1, or no point can move"
            )
        count = max(1, round(self.share * mesh.n_points))
        held = np.zeros(mesh.n_points, dtype=np.bool_)
        held[np.argsort(-mesh.points[:, 2], kind="stable")[:count]] = True
        return held
