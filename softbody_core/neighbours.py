"""Which points are within a radius: a Verlet list."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from softbody_core.mesh import difference_operator

Floats = NDArray[np.float64]

SKIN = 0.1
"""Width by which the list reaches beyond the radius, as a share of it."""


class Pairs(NamedTuple):
    """Neighbouring points as pairs (i, j), i < j, in lexicographic order, and their operators.

    A pair beyond the radius adds an exact zero to sums in this order, so results do not depend, to
    the bit, on when the list was made. That keeps caches out of the body's saved state.
    """

    first: NDArray[np.int64]
    second: NDArray[np.int64]
    to_first: sp.csr_array
    to_second: sp.csr_array
    gather_difference: sp.csr_array


class NeighbourList:
    """Pairs of points within `radius`, found again only when points have moved far enough.

    Parameters
    ----------
    radius : float
        Largest distance of a pair, m. The list holds some pairs that are farther apart.
    """

    def __init__(self, radius: float) -> None:
        self._radius = radius
        self._found: tuple[Floats, Pairs] | None = None

    def pairs(self, positions: Floats) -> Pairs:
        """Return all pairs within the radius of each other, and a few more.

        Parameters
        ----------
        positions : ndarray, shape (3, n)
            Current positions, m.
        """
        if self._found is None or self._moved(positions - self._found[0]):
            self._found = positions, _search(positions, (1 + SKIN) * self._radius)
        return self._found[1]

    def _moved(self, moved: Floats) -> bool:
        # Two points that each move half the skin towards each other may have become neighbours.
        return bool(np.einsum("cn,cn->n", moved, moved).max() > (0.5 * SKIN * self._radius) ** 2)


def _search(positions: Floats, reach: float) -> Pairs:
    n = positions.shape[1]
    found = np.empty((0, 2), dtype=np.int64)
    # A body that has blown up has no neighbours; whoever stepped it finds out next.
    if np.isfinite(np.vdot(positions, positions)):
        found = cKDTree(positions.T).query_pairs(reach, output_type="ndarray").astype(np.int64)
    found = found[np.argsort(found[:, 0] * n + found[:, 1])]
    first, second = np.ascontiguousarray(found.T)
    return Pairs(
        first,
        second,
        _selector(first, n),
        _selector(second, n),
        difference_operator(found, n).T.tocsr(),
    )


def _selector(ends: NDArray[np.int64], n: int) -> sp.csr_array:
    """Operator that sums pair values onto one end of each pair, shape (n, p)."""
    p = len(ends)
    return sp.csr_array((np.ones(p), (ends, np.arange(p))), shape=(n, p))
