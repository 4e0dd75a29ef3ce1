"""The surface in motion: what the points' positions say about edges, areas and volume.

Inside the core, arrays of point values have shape (3, n), one row a component: ``x[0]`` holds all
x-coordinates. Component rows are several times faster than (n, 3) in NumPy, above all for cross
products. What users read from a `SoftBody` is (n, 3).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from softbody_core.mesh import SurfaceMesh

Floats = NDArray[np.float64]


class Configuration:
    """Geometry of one set of positions; each quantity is computed when first asked for.

    Parameters
    ----------
    mesh : SurfaceMesh
        Connectivity and rest shape.
    positions : ndarray, shape (3, n)
        Current positions, m. Not copied: must not change afterwards.
    """

    def __init__(self, mesh: SurfaceMesh, positions: Floats) -> None:
        self.mesh = mesh
        self.positions = positions

    @cached_property
    def edge_vectors(self) -> Floats:
        """x_j − x_i for each edge (i, j), m, shape (3, m)."""
        return pair_differences(self.positions, *self.mesh.edge_ends)

    @cached_property
    def edge_lengths(self) -> Floats:
        """Current length of each edge, m, shape (m,)."""
        return norms(self.edge_vectors)

    @cached_property
    def area_vectors(self) -> Floats:
        """Outward area vector of each triangle, m², shape (3, t)."""
        a, b, c = (self.positions.take(corner, axis=1) for corner in self.mesh.triangle_corners)
        b -= a
        c -= a
        return 0.5 * cross(b, c)

    @cached_property
    def volume_gradient(self) -> Floats:
        """∂V/∂x: one third of the area vectors around each point, m², shape (3, n)."""
        return scatter(self.mesh.triangle_to_points, self.area_vectors) / 3.0

    @cached_property
    def volume(self) -> float:
        """Enclosed volume, m³."""
        # V is homogeneous of degree 3 in x, so 3 V = x · ∂V/∂x about any origin.
        about_first_point = self.positions - self.positions[:, :1]
        return float(np.vdot(self.volume_gradient, about_first_point)) / 3.0

    @cached_property
    def bounding_box(self) -> Floats:
        """Lowest and highest corner of the axis-aligned bounding box, m, shape (2, 3)."""
        return np.stack([self.positions.min(axis=1), self.positions.max(axis=1)])

    @cached_property
    def bounding_box_volume(self) -> float:
        """B, volume of the axis-aligned bounding box, m³."""
        return float(np.prod(self.bounding_box[1] - self.bounding_box[0]))

    @property
    def bounding_box_gradient(self) -> Floats:
        """∂B/∂x, carried by the extreme points alone, m², shape (3, n)."""
        lowest, highest = self.positions.argmin(axis=1), self.positions.argmax(axis=1)
        extent = self.bounding_box[1] - self.bounding_box[0]
        gradient = np.zeros_like(self.positions)
        for axis in range(3):
            face = extent[axis - 1] * extent[axis - 2]
            gradient[axis, highest[axis]] += face
            gradient[axis, lowest[axis]] -= face
        return gradient


def pair_differences(values: Floats, first: NDArray[np.int64], second: NDArray[np.int64]) -> Floats:
    """Differences value_j − value_i over pairs (i, j), shape (3, p)."""
    difference = values.take(second, axis=1)
    difference -= values.take(first, axis=1)
    return difference


def scatter(operator: sp.csr_array, values: Floats) -> Floats:
    """Apply a sparse operator to each of the three component rows."""
    return np.stack([operator @ row for row in values])


def norms(vectors: Floats) -> Floats:
    """Lengths of the columns of a (3, k) array."""
    return np.asarray(np.sqrt(np.einsum("ck,ck->k", vectors, vectors)))


def cross(a: Floats, b: Floats) -> Floats:
    """Cross products of the columns of two (3, k) arrays."""
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
