"""Flat surfaces for tests: two parallel sheets with a rim, and points to make them of."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from softbody_core import SurfaceMesh


def lattice(rings, size=1.0):
    """Points of a net of equilateral triangles that fills a hexagon, (n, 2), circumradius size."""
    i, j = np.meshgrid(np.arange(-rings, rings + 1), np.arange(-rings, rings + 1))
    inside = np.abs(i + j) <= rings
    i, j = i[inside], j[inside]
    return size / rings * np.stack([i + j / 2, np.sqrt(3) / 2 * j], axis=1)


def slab(points, thickness=0.1):
    """Closed surface of two sheets on the same points in the plane; the first n are on top."""
    n = len(points)
    top = Delaunay(points).simplices
    a, b, c = points[top].transpose(1, 0, 2)
    backward = (b - a)[:, 0] * (c - a)[:, 1] < (b - a)[:, 1] * (c - a)[:, 0]
    top[backward] = top[backward][:, ::-1]
    sides = top[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    start, end = np.array(sorted(set(map(tuple, sides)) - set(map(tuple, sides[:, ::-1])))).T
    rim = [[end, start, start + n], [end, start + n, end + n]]
    triangles = np.concatenate([top, top[:, ::-1] + n, *(np.stack(part, axis=1) for part in rim)])
    height = np.repeat([thickness / 2, -thickness / 2], n)
    return SurfaceMesh.from_arrays(np.column_stack([np.tile(points, (2, 1)), height]), triangles)
