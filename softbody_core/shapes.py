"""Shapes that are made rather than read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from softbody_core.ground.errors import ParameterError
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


def fibonacci_sphere(n_points: int, radius: float = 1.0) -> SurfaceMesh:
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


def revolved(profile: Sequence[tuple[float, float]], segments: int) -> SurfaceMesh:
    """Closed surface of revolution about the z-axis.

    Parameters
    ----------
    profile : sequence of (r, z)
        Radius and height of the points of the outline, m, counter-clockwise in the (r, z) plane.
        The first and the last are on the axis, the others are not.
    segments : int
        Parts of a full turn, at least 3.

    Raises
    ------
    ParameterError
        If the profile does not start and end on the axis, or there are too few segments.
    """
    if segments < 3:
        raise ParameterError(f"{segments} segments of a surface of revolution: expected at least 3")
    radius, height = np.array(profile, dtype=np.float64).T
    if radius[0] != 0 or radius[-1] != 0 or np.any(radius[1:-1] <= 0) or len(radius) < 3:
        raise ParameterError(
            "the profile of a surface of revolution starts and ends at r = 0, and has only "
            f"points with r > 0 in between; got r = {radius.tolist()}"
        )
    turn = 2 * np.pi * np.arange(segments) / segments
    rings = [
        np.stack([r * np.cos(turn), r * np.sin(turn), np.full(segments, z)], axis=1)
        for r, z in zip(radius[1:-1], height[1:-1], strict=True)
    ]
    bottom, top = [[0.0, 0.0, height[0]]], [[0.0, 0.0, height[-1]]]
    points = np.concatenate([bottom, *rings, top])
    around = np.arange(segments)
    along = np.roll(around, -1)
    triangles = [np.stack([np.zeros_like(around), 1 + along, 1 + around], axis=1)]
    for ring in range(len(rings) - 1):
        a, b = 1 + ring * segments, 1 + (ring + 1) * segments
        triangles.append(np.stack([a + around, a + along, b + along], axis=1))
        triangles.append(np.stack([a + around, b + along, b + around], axis=1))
    last = 1 + (len(rings) - 1) * segments
    tip = np.full_like(around, len(points) - 1)
    triangles.append(np.stack([last + around, last + along, tip], axis=1))
    return SurfaceMesh.from_arrays(points, np.concatenate(triangles))


_WINE_GLASS: Final = (
    *[(0.0, 0.0), (0.034, 0.0), (0.034, 0.002), (0.020, 0.004), (0.006, 0.010), (0.004, 0.020)],
    *[(0.004, 0.085), (0.008, 0.092), (0.022, 0.100), (0.034, 0.115), (0.0395, 0.135)],
    *[(0.0405, 0.155), (0.038, 0.180), (0.034, 0.205), (0.0325, 0.205), (0.0365, 0.180)],
    *[(0.0388, 0.155), (0.0378, 0.135), (0.0325, 0.1165), (0.021, 0.1025), (0.008, 0.0955)],
    (0.0, 0.095),
)
"""Radius and height, m: from the foot up the outer wall to the rim, and down the inner one."""


def wine_glass(segments: int = 96) -> SurfaceMesh:
    """Wine glass of 205 mm with walls of 1.5 mm; its bowl holds 0.4 L.

    Parameters
    ----------
    segments : int
        Parts of a full turn.
    """
    return revolved(_WINE_GLASS, segments)
