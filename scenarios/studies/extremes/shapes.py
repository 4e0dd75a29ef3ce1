"""Surfaces and starts that a body was not made for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from softbody_core import SurfaceMesh

Floats = NDArray[np.float64]

Shape = Callable[[SurfaceMesh], tuple[SurfaceMesh, Floats | None]]
"""From the scenario's surface to a surface at rest, and where its points start if not there."""


def _at_rest(points: Callable[[SurfaceMesh], Floats]) -> Shape:
    """Move the points of the rest shape. `MeshError` where that leaves no surface."""
    return lambda mesh: (SurfaceMesh.from_arrays(points(mesh), mesh.triangles), None)


def _at_start(points: Callable[[SurfaceMesh], Floats]) -> Shape:
    """Keep the rest shape, and start elsewhere."""
    return lambda mesh: (mesh, points(mesh))


def _squashed(share: float) -> Callable[[SurfaceMesh], Floats]:
    """Flatten along z to a share of the height."""
    return lambda mesh: _about_centre(mesh, np.array([1.0, 1.0, share]))


def _shrunk(share: float) -> Callable[[SurfaceMesh], Floats]:
    return lambda mesh: _about_centre(mesh, np.full(3, share))


def _moved(distance: float) -> Callable[[SurfaceMesh], Floats]:
    return lambda mesh: mesh.points + np.array([distance, -distance, distance])


def _joined(share: float) -> Callable[[SurfaceMesh], Floats]:
    """Shorten one edge to a share of its length; its two triangles become slivers."""

    def points(mesh: SurfaceMesh) -> Floats:
        moved = mesh.points.copy()
        i, j = mesh.edges[len(mesh.edges) // 2]
        moved[j] = moved[i] + share * (moved[j] - moved[i])
        return moved

    return points


def _pulled_through(mesh: SurfaceMesh) -> Floats:
    """Pull one point out on the other side of the body."""
    points, centre = mesh.points.copy(), mesh.points.mean(axis=0)
    points[0] = centre - 1.5 * (points[0] - centre)
    return points


def _about_centre(mesh: SurfaceMesh, factors: Floats) -> Floats:
    centre = mesh.points.mean(axis=0)
    scaled: Floats = centre + factors * (mesh.points - centre)
    return scaled


def _inside_out(mesh: SurfaceMesh) -> tuple[SurfaceMesh, None]:
    return SurfaceMesh.from_arrays(mesh.points, mesh.triangles[:, ::-1]), None


SHAPES: Final[dict[str, Shape]] = {
    "as it is": lambda mesh: (mesh, None),
    "sliver, 1e-3": _at_rest(_joined(1e-3)),
    "sliver, 1e-6": _at_rest(_joined(1e-6)),
    "sliver, 1e-9": _at_rest(_joined(1e-9)),
    "two points at one": _at_rest(_joined(0.0)),
    "thin, 1e-2": _at_rest(_squashed(1e-2)),
    "thin, 1e-6": _at_rest(_squashed(1e-6)),
    "flat": _at_rest(_squashed(0.0)),
    "inside out": _inside_out,
    "1e3 m away": _at_rest(_moved(1e3)),
    "1e6 m away": _at_rest(_moved(1e6)),
    "1e9 m away": _at_rest(_moved(1e9)),
    "1e12 m away": _at_rest(_moved(1e12)),
    "1e18 m away": _at_rest(_moved(1e18)),
    "starts with two points at one": _at_start(_joined(0.0)),
    "starts thin, 1e-3": _at_start(_squashed(1e-3)),
    "starts flat": _at_start(_squashed(0.0)),
    "starts inside out": _at_start(_shrunk(-1.0)),
    "starts pulled through itself": _at_start(_pulled_through),
    "starts small, 0.1": _at_start(_shrunk(0.1)),
    "starts as a clump, 1e-6": _at_start(_shrunk(1e-6)),
    "starts as one point": _at_start(_shrunk(0.0)),
    "starts large, 5": _at_start(_shrunk(5.0)),
}
"""Shapes at rest by what is wrong with them, and starts by where the points are."""
