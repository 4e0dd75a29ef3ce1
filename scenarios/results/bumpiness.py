"""How bumpy a surface is: its distance from its own smooth shape."""

from __future__ import annotations

from typing import Final

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from trimesh.smoothing import filter_taubin

_SHRINK: Final = 0.5
_GROW: Final = 0.53
_PASSES: Final = 50
"""Taubin's λ, μ and number of passes. Of a wave of 8 edges the smoothed surface keeps 97 %, of 6
edges 78 %, of 4 edges 22 %, of 3 edges 1 %: so the waves that count are those of the length that a
fluid of radius h_w = 2 edges makes."""


def normal_deviation(points: ArrayLike, triangles: ArrayLike) -> NDArray[np.float64]:
    """Distance of each point from the smoothed surface, along its normal, over the mean edge.

    The surface is smoothed by G. Taubin's filter (SIGGRAPH 1995), which takes short waves out and
    does not shrink long ones.

    Parameters
    ----------
    points : array_like, shape (n, 3)
        Positions, in any unit.
    triangles : array_like of int, shape (m, 3)
        Counter-clockwise seen from outside.

    Returns
    -------
    ndarray, shape (n,)
        Positive outside the smoothed surface, 1.
    """
    mesh = trimesh.Trimesh(points, triangles, process=False)
    smooth = filter_taubin(mesh.copy(), lamb=_SHRINK, nu=_GROW, iterations=_PASSES)
    apart = np.einsum("ij,ij->i", mesh.vertices - smooth.vertices, smooth.vertex_normals)
    return np.asarray(apart / mesh.edges_unique_length.mean())


def bumpiness(points: ArrayLike, triangles: ArrayLike, rest: ArrayLike | None = None) -> float:
    """Root mean square of `normal_deviation`; with a shape at rest, less its value there.

    It does not change when the surface is moved, turned or scaled. Below zero means smoother than
    at rest: a shape with edges loses them when it is blown up.

    Parameters
    ----------
    points, triangles
        As in `normal_deviation`.
    rest : array_like, shape (n, 3), optional
        Positions at rest.
    """
    value = float(np.sqrt(np.mean(normal_deviation(points, triangles) ** 2)))
    return value if rest is None else value - bumpiness(rest, triangles)
