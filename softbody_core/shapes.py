"""Shapes that are made rather than read."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from softbody_core.errors import ParameterError
from softbody_core.mesh import SurfaceMesh


def icosphere(subdivisions: int, radius: float = 1.0) -> SurfaceMesh:
    """Icosahedron whose triangles are split in four, again and again, onto the sphere.

    The most even of all spheres: 0 to 5 subdivisions give 12, 42, 162, 642, 2562, 10242 points.

    Parameters
    ----------
    subdivisions : int
        How often to split, from 0 to 8.
    radius : float
        Radius, m.

    Raises
    ------
    ParameterError
        If there are too many subdivisions, or fewer than none.
    """
    if not 0 <= subdivisions <= 8:
        raise ParameterError(f"icosphere of {subdivisions} subdivisions: expected 0 to 8")
    sphere = trimesh.creation.icosphere(subdivisions)
    return SurfaceMesh.from_arrays(radius * sphere.vertices, sphere.faces)


def ball(n_points: int, radius: float = 1.0) -> SurfaceMesh:
    """Fibonacci points on a sphere, joined by their convex hull.

    Any number of points can be had, at the price of an uneven net: springs on it yield about a
    tenth more than on an icosphere. 1986 points give 3968 triangles and 5952 edges, the counts of
    Mesit & Guha 2011, section 4.

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
