"""The surface in motion: what the points' positions say about edges, areas and volume.

Inside the core, arrays of point values have shape (3, n), one row a component: ``x[0]`` holds all
x-coordinates. Component rows are several times faster than (n, 3) in NumPy, above all for cross
products. What users read from a `SoftBody` is (n, 3).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp

from softbody_core.ground.arrays import Floats, Integers
from softbody_core.mesh import SurfaceMesh


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
        self._arrays: dict[str, Floats] = {}

    def move_to(self, positions: Floats) -> None:
        """Take other positions, and overwrite every array that was given out before.

        A body in motion then allocates nothing: large new arrays cost more than what fills them.
        """
        mesh, arrays = self.mesh, self._arrays
        vars(self).clear()
        self.mesh, self._arrays = mesh, arrays
        self.positions = positions

    def _array(self, name: str, *shape: int) -> Floats:
        if name not in self._arrays:
            self._arrays[name] = np.empty(shape)
        return self._arrays[name]

    @cached_property
    def _about_first_point(self) -> Floats:
        """Positions seen from the first point: far from the origin, products keep their digits."""
        relative = self._array("about_first_point", *self.positions.shape)
        return np.subtract(self.positions, self.positions[:, :1], out=relative)

    @cached_property
    def _edge_ends(self) -> tuple[Floats, Floats]:
        """Where the edges start and end, m, both of shape (3, m)."""
        m = len(self.mesh.edges)
        starts, ends = self._array("edge_starts", 3, m), self._array("edge_ends", 3, m)
        for end, out in zip(self.mesh.edge_ends, (starts, ends), strict=True):
            take(self._about_first_point, end, out)
        return starts, ends

    @cached_property
    def edge_vectors(self) -> Floats:
        """x_j − x_i for each edge (i, j), m, shape (3, m)."""
        starts, ends = self._edge_ends
        return np.subtract(ends, starts, out=self._array("edge_vectors", *ends.shape))

    @cached_property
    def edge_lengths(self) -> Floats:
        """Current length of each edge, m, shape (m,)."""
        vectors = self.edge_vectors
        return norms(vectors, self._array("edge_lengths", vectors.shape[1]))

    @cached_property
    def volume_gradient(self) -> Floats:
        """∂V/∂x, one third of the area vectors around each point, m², shape (3, n).

        V = Σ x_a · (x_b × x_c) / 6 over the triangles (a, b, c), so a point feels a sixth of
        x_b × x_c of each edge that faces it.
        """
        starts, ends = self._edge_ends
        crossed = self._array("crossed", *starts.shape)
        cross(starts, ends, crossed, self._array("product", starts.shape[1]))
        return scatter(self.mesh.edges_to_facing_points, crossed)

    @cached_property
    def volume(self) -> float:
        """Enclosed volume, m³."""
        # V is homogeneous of degree 3 in x, so 3 V = x · ∂V/∂x about any origin.
        return float(np.vdot(self.volume_gradient, self._about_first_point)) / 3.0

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


def take(values: Floats, indices: Integers, out: Floats) -> None:
    """Write some columns of a (3, n) array into `out`, shape (3, k)."""
    for row, taken in zip(values, out, strict=True):
        row.take(indices, out=taken, mode="clip")  # the other modes make a copy first


def scatter(operator: sp.csr_array, values: Floats) -> Floats:
    """Apply an operator made by `per_component` to a (3, k) array."""
    return np.asarray(operator @ values.reshape(-1)).reshape(3, -1)


def norms(vectors: Floats, out: Floats | None = None) -> Floats:
    """Lengths of the columns of a (3, k) array."""
    squares = np.einsum("ck,ck->k", vectors, vectors, out=out)
    return np.asarray(np.sqrt(squares, out=squares))


def cross(a: Floats, b: Floats, out: Floats, scratch: Floats) -> None:
    """Cross products of the columns of two (3, k) arrays; `scratch` has shape (k,)."""
    for axis in range(3):
        np.multiply(a[axis - 2], b[axis - 1], out=out[axis])
        np.multiply(a[axis - 1], b[axis - 2], out=scratch)
        out[axis] -= scratch
