"""Which points are within a radius: a Verlet list."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from softbody_core.errors import CrowdedError

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

SKIN = 0.1
"""Width by which the list reaches beyond the radius, as a share of it."""

MOST_PAIRS = 5_000_000
"""Pairs that a list may hold; its arrays then take about a gigabyte."""

MOST_CROWDED = 20
"""Times the first list's pairs that a later one may hold: a body that has collapsed holds more."""


class Pairs(NamedTuple):
    """Neighbouring points as pairs (i, j), i < j, in lexicographic order, each of shape (p,).

    A pair beyond the radius adds an exact zero to sums in this order, so results do not depend, to
    the bit, on when the list was made. That keeps caches out of the body's saved state.
    """

    first: Indices
    second: Indices


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
        self._allowed = MOST_PAIRS

    def pairs(self, positions: Floats) -> Pairs:
        """Return all pairs within the radius of each other, and a few more.

        The same object is returned until a new list is made.

        Parameters
        ----------
        positions : ndarray, shape (3, n)
            Current positions, m.

        Raises
        ------
        CrowdedError
            If there are so many that the surface must have fallen in on itself.
        """
        if self._found is None or self._moved(positions - self._found[0]):
            found = self._search(positions)
            if self._found is None:
                self._allowed = min(
                    MOST_PAIRS, MOST_CROWDED * max(len(found.first), len(positions.T))
                )
            self._found = positions, found
        return self._found[1]

    def _moved(self, moved: Floats) -> bool:
        # Two points that each move half the skin towards each other may have become neighbours.
        return bool(np.einsum("cn,cn->n", moved, moved).max() > (0.5 * SKIN * self._radius) ** 2)

    def _search(self, positions: Floats) -> Pairs:
        n = positions.shape[1]
        # A body that has blown up has no neighbours; whoever stepped it finds out next.
        if not np.isfinite(np.vdot(positions, positions)):
            nobody = np.empty(0, dtype=np.int64)
            return Pairs(nobody, nobody)
        tree, reach = cKDTree(positions.T), (1 + SKIN) * self._radius
        if n * (n - 1) // 2 > self._allowed:
            count = (int(tree.count_neighbors(tree, reach)) - n) // 2
            if count > self._allowed:
                raise CrowdedError(count, n, self._radius)
        found = tree.query_pairs(reach, output_type="ndarray").astype(np.int64)
        found = found[np.argsort(found[:, 0] * n + found[:, 1])]
        return Pairs(*np.ascontiguousarray(found.T))
