"""What a bad surface is, and how to say where it is bad."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from softbody_core.errors import MeshError
from softbody_core.ground.arrays import Floats, Integers

SMALLEST_SIZE, LARGEST_SIZE = 1e-9, 1e9
"""Sizes within which volumes, areas and kernels keep clear of under- and overflow, m."""

COARSEST_DIGIT = 1e-6
"""Distance of neighbouring floating-point numbers, over the size, that leaves a shape."""


def check_surface(points: Floats, triangles: NDArray[np.generic]) -> None:
    """Raise `MeshError` unless the arrays are a closed, manifold, outward-wound surface.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Positions, m.
    triangles : ndarray, shape (t, 3)
        Point indices.
    """
    _check_arrays(points, triangles)
    corners = triangles.astype(np.int64)
    _check_triangles(points, corners)
    _check_edges(points, corners)
    _check_fans(points, corners)
    _check_whole(points, corners)
    centred = points - points.mean(axis=0)
    a, b, c = (centred[corners[:, k]] for k in range(3))
    volume = float(np.einsum("tk,tk->", a, np.cross(b, c)) / 6)
    box = float(np.prod(np.ptp(points, axis=0)))
    if volume < 0:
        raise MeshError(
            f"the surface is wound inside out: its enclosed volume is {volume:.4g} m³; "
            "reverse the triangles (triangles[:, ::-1])"
        )
    if volume <= 1e-12 * box or box == 0:
        raise MeshError(f"the surface encloses no volume ({volume:.4g} m³); it is flat")


def _check_arrays(points: Floats, triangles: NDArray[np.generic]) -> None:
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 4:
        raise MeshError(f"points have shape {points.shape}; expected (n, 3) with n of at least 4")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) < 4:
        raise MeshError(
            f"triangles have shape {triangles.shape}; expected (t, 3) with t of at least 4"
        )
    if not np.issubdtype(triangles.dtype, np.integer):
        raise MeshError(f"triangles have type {triangles.dtype}; expected integer point indices")
    bad = ~np.isfinite(points).all(axis=1)
    if bad.any():
        raise MeshError(_located(bad, "points", "have NaN or infinite coordinates"))
    size = float(np.ptp(points, axis=0).max())
    farthest = float(np.abs(points).max())
    if np.spacing(farthest) > COARSEST_DIGIT * size > 0:
        raise MeshError(
            f"the surface is {size:.3g} m wide, but {farthest:.3g} m away from the origin, where "
            f"coordinates are {np.spacing(farthest):.2g} m apart: move it to the origin"
        )
    if size == 0:
        raise MeshError("all points are at one place")
    if not SMALLEST_SIZE <= size <= LARGEST_SIZE:
        raise MeshError(
            f"the surface is {size:.3g} m wide; expected {SMALLEST_SIZE:g} to {LARGEST_SIZE:g} m"
        )
    corners = triangles.astype(np.int64)
    outside = ((corners < 0) | (corners >= len(points))).any(axis=1)
    if outside.any():
        raise MeshError(
            _located(outside, "triangles", f"name points outside 0 … {len(points) - 1}")
        )


def _check_triangles(points: Floats, corners: Integers) -> None:
    unused = np.bincount(corners.ravel(), minlength=len(points)) == 0
    if unused.any():
        raise MeshError(
            _located(unused, "points", "belong to no triangle", points)
            + "; weld=True (mesh.weld = true) drops them"
        )
    a, b, c = (points[corners[:, k]] for k in range(3))
    repeated = (corners == np.roll(corners, 1, axis=1)).any(axis=1)
    longest = np.maximum.reduce([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))])
    doubled_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    # Below 1e-10 of the longest side squared, rounding decides where a triangle's normal points.
    degenerate = repeated | (doubled_area <= 1e-10 * longest)
    if degenerate.any():
        raise MeshError(
            _located(degenerate, "triangles", "are degenerate (no area)", a)
            + "; remove slivers, or weld points that coincide (weld=True, mesh.weld = true)"
        )


def _check_edges(points: Floats, corners: Integers) -> None:
    directed = corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges, which = unique_pairs(np.sort(directed, axis=1))
    faces = np.bincount(which)
    middle = points[edges].mean(axis=1)
    if (faces == 1).any():
        raise MeshError(
            _located(faces == 1, "edges", "have only one triangle, so the surface is open", middle)
            + "; close the holes, or weld points that coincide (weld=True, mesh.weld = true)"
        )
    if (faces > 2).any():
        raise MeshError(
            _located(faces > 2, "edges", "have more than two triangles (non-manifold)", middle)
        )
    forward = np.bincount(which, weights=directed[:, 0] < directed[:, 1])
    if (forward != 1).any():
        raise MeshError(
            _located(forward != 1, "edges", "have triangles wound in opposite senses", middle)
            + "; make the winding consistent"
        )


def _check_fans(points: Floats, corners: Integers) -> None:
    """Refuse a point at which two fans of triangles touch; corners that share a side are one."""
    n, t = len(points), len(corners)
    corner_of = np.arange(3 * t).reshape(t, 3)
    starts, ends = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    following = np.roll(corner_of, -1, axis=1).ravel()
    forward, backward = np.argsort(starts * n + ends), np.argsort(ends * n + starts)
    # Side (i, j) of one triangle meets side (j, i) of its neighbour: join their corners at i.
    joined = (forward, following[backward])
    links = sp.coo_array((np.ones(3 * t), joined), shape=(3 * t, 3 * t))
    count, fan = connected_components(links, directed=False)
    point_of_fan = np.empty(count, dtype=np.int64)
    point_of_fan[fan] = corners.ravel()
    pinched = np.bincount(point_of_fan, minlength=len(points)) > 1
    if pinched.any():
        raise MeshError(
            _located(pinched, "points", "join separate fans of triangles (non-manifold)", points)
        )


def _check_whole(points: Floats, corners: Integers) -> None:
    """Refuse several surfaces: nested or overlapping ones would count volume twice or take it."""
    n = len(points)
    rows, columns = corners.ravel(), np.roll(corners, 1, axis=1).ravel()
    sides = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(n, n))
    count, _ = connected_components(sides, directed=False)
    if count > 1:
        raise MeshError(f"there are {count} separate surfaces; expected one: keep the one you mean")


def unique_pairs(pairs: Integers) -> tuple[Integers, Integers]:
    """Find the different pairs (i, j) of indices, in lexicographic order, and which each one is.

    Packed into one number, i n + j, pairs sort several times faster than as rows.

    Parameters
    ----------
    pairs : ndarray of int, shape (k, 2)
        Each index at least 0, and below 2³¹.

    Returns
    -------
    different : ndarray of int, shape (m, 2)
        Each pair once.
    which : ndarray of int, shape (k,)
        Row of each given pair in `different`.
    """
    n = int(pairs.max()) + 1
    keys, which = np.unique(pairs[:, 0] * n + pairs[:, 1], return_inverse=True)
    return np.stack(np.divmod(keys, n), axis=1), which


def _located(bad: Any, things: str, fault: str, places: Floats | None = None) -> str:
    """Count the faults and name the first three, with their places."""
    indices = np.flatnonzero(bad)
    shown = ", ".join(
        str(i) if places is None else f"{i} at ({', '.join(f'{x:.4g}' for x in places[i])})"
        for i in indices[:3]
    )
    more = ", …" if len(indices) > 3 else ""
    return f"{len(indices)} of {len(bad)} {things} {fault}: {things[:-1]} {shown}{more}"
