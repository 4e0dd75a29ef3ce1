"""Shapes that are made rather than read."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from softbody_core.errors import ParameterError
from softbody_core.mesh import SurfaceMesh


def ball(n_points: int, radius: float = 1.0) -> SurfaceMesh:
    """Fibonacci points on a sphere, joined by their convex hull.

    1986 points give 3968 triangles and 5952 edges, the counts of Mesit & Guha 2011, section 4.

    Parameters
    ----------
    n_points : int
        Number of points, at least 4.
    radius : float
        Radius, m.

    Raises
    ------
    ParameterError
        If there are fewer than 4 points.
    """
    if n_points < 4:
        raise ParameterError(f"ball of {n_points} points: expected at least 4")
    index = np.arange(n_points)
    height = 1 - (2 * index + 1) / n_points
    turn = np.pi * (1 + np.sqrt(5)) * index
    width = np.sqrt(1 - height**2)
    points = np.stack([width * np.cos(turn), width * np.sin(turn), height], axis=1)
    hull = ConvexHull(points)
    triangles = hull.simplices.astype(np.int64)
    corner = points[triangles]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    inward = np.einsum("tk,tk->t", normals, corner[:, 0]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return SurfaceMesh.from_arrays(radius * points, triangles)
