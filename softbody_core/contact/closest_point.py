"""The closest point of a triangle mesh, by libigl's tree of bounding boxes.

libigl answers in double precision and takes 2 to 3 µs for a point near the surface; trimesh with
rtree takes twenty times that, and is off by 30 µm there (``benchmarks/closest_point.py``).
"""

from __future__ import annotations

import numpy as np

from softbody_core.ground.arrays import Booleans, Floats, Integers


class ClosestPoint:
    """Closest points of one mesh.

    Parameters
    ----------
    points : ndarray, shape (m, 3)
        Where the mesh's points are, m.
    triangles : ndarray of int, shape (t, 3)
        Its triangles.
    """

    def __init__(self, points: Floats, triangles: Integers) -> None:
        import igl  # here, so that a scene without obstacles does not load it

        self._points = np.ascontiguousarray(points)
        self._triangles = np.ascontiguousarray(triangles)
        self._winding_number = igl.fast_winding_number
        self._tree = igl.AABB()
        self._tree.init(self._points, self._triangles)
        self._lowest, self._highest = points.min(axis=0)[:, None], points.max(axis=0)[:, None]

    def __call__(self, points: Floats) -> tuple[Floats, Floats]:
        """Find the closest points of the mesh, m, shape (3, k), and their distances, m, (k,)."""
        squares, _, closest = self._tree.squared_distance(
            self._points, self._triangles, np.ascontiguousarray(points.T)
        )
        return closest.T, np.sqrt(squares)

    def distance_to_box(self, points: Floats) -> Floats:
        """Distance from the mesh's bounding box, 0 inside it: a bound that costs little."""
        beyond = np.maximum(self._lowest - points, points - self._highest)
        np.maximum(beyond, 0.0, out=beyond)
        return np.asarray(np.sqrt(np.einsum("ck,ck->k", beyond, beyond)))

    def inside(self, points: Floats) -> Booleans:
        """True for points within the material, shape (k,)."""
        winding = self._winding_number(
            self._points, self._triangles, np.ascontiguousarray(points.T)
        )
        return np.asarray(winding > 0.5)
