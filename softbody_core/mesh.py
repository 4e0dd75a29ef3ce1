"""The surface O = ⟨P, E, T⟩: points, edges, triangles, and sparse operators between them.

Points never move here: a `SurfaceMesh` is the body at rest. Its connectivity holds for every later
configuration (Mesit & Guha 2011, section 2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
import scipy.sparse as sp
import trimesh
from numpy.typing import ArrayLike, NDArray

from softbody_core.errors import MeshError
from softbody_core.ground.arrays import Floats, Integers
from softbody_core.mesh_check import check_surface, unique_pairs


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """A closed, outward-wound triangle surface at rest. Make one with a ``from_…`` method.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Rest positions, m.
    triangles : ndarray of int, shape (t, 3)
        Point indices, counter-clockwise seen from outside.
    """

    points: Floats
    triangles: Integers

    @classmethod
    def from_arrays(cls, points: ArrayLike, triangles: ArrayLike, *, weld: bool = False) -> Self:
        """Check two arrays and make a mesh of them.

        Parameters
        ----------
        points : array_like, shape (n, 3)
            Positions, m.
        triangles : array_like of int, shape (t, 3)
            Point indices.
        weld : bool
            Merge points at the same position first, and drop points that no triangle uses.

        Raises
        ------
        MeshError
            If the surface is open, non-manifold, inconsistently or inwardly wound, degenerate, or
            has NaN coordinates. The message counts the faults and says where the first ones are.
        """
        points = np.array(points, dtype=np.float64)
        triangles = np.array(triangles)
        if weld:
            points, triangles = _weld(points, triangles)
        check_surface(points, triangles)
        triangles = triangles.astype(np.int64)
        points.flags.writeable = False
        triangles.flags.writeable = False
        return cls(points, triangles)

    @classmethod
    def from_file(cls, path: str | Path, *, weld: bool = False) -> Self:
        """Read any surface file that trimesh reads (PLY, OBJ, STL, OFF, …), coordinates in metres.

        Parameters
        ----------
        path : str or Path
            The file.
        weld : bool
            Merge points at the same position. STL files need it: they repeat every corner.

        Raises
        ------
        MeshError
            If the file is missing, is no mesh, or holds a surface that `from_arrays` refuses.
        """
        path = Path(path)
        if not path.is_file():
            raise MeshError(f"mesh file {path} does not exist; check the path")
        try:
            surface = trimesh.load_mesh(path, process=False)
        except Exception as error:  # its readers raise whatever their parsers raise
            raise MeshError(
                f"mesh file {path} cannot be read ({type(error).__name__}: {error}); "
                "expected a surface file such as PLY, OBJ, STL or OFF"
            ) from error
        if not isinstance(surface, trimesh.Trimesh) or len(surface.faces) == 0:
            raise MeshError(
                f"mesh file {path} holds no triangles; expected one closed triangle surface"
            )
        try:
            return cls.from_arrays(surface.vertices, surface.faces, weld=weld)
        except MeshError as error:
            raise MeshError(f"mesh file {path}: {error}") from error

    def scaled(self, factor: float) -> SurfaceMesh:
        """Return the same surface with all coordinates times `factor`."""
        return SurfaceMesh.from_arrays(self.points * factor, self.triangles)

    def scaled_to_volume(self, volume: float) -> SurfaceMesh:
        """Return the same shape with an enclosed volume of `volume`, m³."""
        return self.scaled(float(np.cbrt(volume / self.volume)))

    def moved(self, by: ArrayLike) -> SurfaceMesh:
        """Return the same surface moved by a vector, m."""
        return SurfaceMesh.from_arrays(self.points + np.asarray(by), self.triangles)

    @property
    def n_points(self) -> int:
        """Number of points."""
        return len(self.points)

    @cached_property
    def edges(self) -> Integers:
        """Edges E as point pairs (i, j) with i < j, in lexicographic order, shape (m, 2)."""
        return self._edges_and_sides[0]

    @cached_property
    def edge_ends(self) -> tuple[Integers, Integers]:
        """First and second points of the edges, each contiguous, shape (m,)."""
        first, second = np.ascontiguousarray(self.edges.T)
        return first, second

    @cached_property
    def triangle_edges(self) -> Integers:
        """Edges of each triangle: that of its corners 0–1, 1–2 and 2–0, shape (t, 3)."""
        return self._edges_and_sides[1]

    @cached_property
    def _edges_and_sides(self) -> tuple[Integers, Integers]:
        sides = np.sort(self.triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        edges, which = unique_pairs(sides)
        return edges, which.reshape(-1, 3)

    @cached_property
    def edge_difference(self) -> sp.csr_array:
        """Incidence operator D, shape (m, n): (D x)_e = x_j − x_i for edge e = (i, j)."""
        return difference_operator(self.edges, self.n_points)

    @cached_property
    def laplacian(self) -> sp.csr_array:
        """Graph Laplacian Dᵀ D, shape (n, n)."""
        return sp.csr_array(self.edge_difference.T @ self.edge_difference)

    @cached_property
    def triangle_to_points(self) -> sp.csr_array:
        """Sum over the triangles of each point, shape (n, t)."""
        t = len(self.triangles)
        entries = (np.ones(3 * t), (self.triangles.ravel(), np.repeat(np.arange(t), 3)))
        return sp.csr_array(entries, shape=(self.n_points, t))

    @cached_property
    def edge_wings(self) -> Integers:
        """Two points that face each edge in its two triangles, shape (m, 2)."""
        opposite = self.triangles[:, [2, 0, 1]].ravel()
        order = np.argsort(self.triangle_edges.ravel(), kind="stable")
        return opposite[order].reshape(-1, 2)

    @cached_property
    def edges_to_facing_points(self) -> sp.csr_array:
        """A sixth of what edges carry, summed at the points that face them, shape (3n, 3m).

        The sign is that of the edge in the triangle between: positive where it runs from its first
        point to its second.
        """
        start, end = self.triangles, self.triangles[:, [1, 2, 0]]
        signs = np.where(start < end, 1 / 6, -1 / 6)
        facing = self.triangles[:, [2, 0, 1]]
        entries = (signs.ravel(), (facing.ravel(), self.triangle_edges.ravel()))
        return per_component(sp.csr_array(entries, shape=(self.n_points, len(self.edges))))

    @cached_property
    def _triangle_normals(self) -> Floats:
        corner = self.points[self.triangles]
        return 0.5 * np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])

    @cached_property
    def volume(self) -> float:
        """Enclosed volume, m³."""
        # About the centre: far from the origin the divergence theorem loses digits.
        centred = self.points[self.triangles[:, 0]] - self.points.mean(axis=0)
        return float(np.einsum("tk,tk->", centred, self._triangle_normals) / 3)

    @property
    def radius(self) -> float:
        """Radius of a ball of the enclosed volume, m."""
        return float(np.cbrt(3 * self.volume / (4 * np.pi)))

    @cached_property
    def area(self) -> float:
        """Surface area, m²."""
        return float(np.linalg.norm(self._triangle_normals, axis=1).sum())

    @cached_property
    def point_areas(self) -> Floats:
        """Area share of each point, one third of its triangles, m², shape (n,)."""
        areas = np.linalg.norm(self._triangle_normals, axis=1)
        return np.asarray(self.triangle_to_points @ areas) / 3

    @cached_property
    def edge_lengths(self) -> Floats:
        """Rest lengths of the edges, m, shape (m,)."""
        return np.asarray(np.linalg.norm(self.edge_difference @ self.points, axis=1))


def difference_operator(pairs: Integers, n_points: int) -> sp.csr_array:
    """Sparse operator that maps point values to their differences x_j − x_i over pairs (i, j)."""
    m = len(pairs)
    entries = (np.tile([-1.0, 1.0], m), pairs.ravel(), np.arange(0, 2 * m + 1, 2))
    return sp.csr_array(entries, shape=(m, n_points))


def per_component(operator: sp.csr_array) -> sp.csr_array:
    """Operator on ravelled (3, k) arrays that acts on each component as the given one does.

    One product with it costs about half of three products with the given one.
    """
    rows, columns = operator.shape
    nnz = operator.nnz
    kind = np.int32 if 3 * max(nnz, columns) < np.iinfo(np.int32).max else np.int64
    offsets = np.arange(3, dtype=kind)[:, None]
    indices = operator.indices.astype(kind) + columns * offsets
    ends = operator.indptr[1:].astype(kind) + nnz * offsets
    indptr = np.concatenate([np.zeros(1, kind), ends.ravel()])
    return sp.csr_array(
        (np.tile(operator.data, 3), indices.ravel(), indptr), shape=(3 * rows, 3 * columns)
    )


def _weld(points: Floats, triangles: NDArray[np.generic]) -> tuple[Floats, NDArray[np.generic]]:
    """Merge points at exactly the same position and drop unused ones, keeping the order."""
    used, corners = np.unique(triangles, return_inverse=True)
    _, first, merged = np.unique(points[used], axis=0, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return points[used[np.sort(first)]], rank[merged.ravel()][corners.reshape(triangles.shape)]
