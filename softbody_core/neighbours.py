"""Which points are within a radius: a Verlet list."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from softbody_core.errors import CrowdedError
from softbody_core.ground.arrays import Floats, Integers

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

    first: Integers
    second: Integers


class NeighbourList:
    """Pairs of points within `radius`, found again only when points have moved far enough.

    Parameters
    ----------
    radius : float
        Largest distance of a pair, m. The list holds some pairs that are farther apart.
    """

    def __init__(self, radius: float) -> None:
        self._radius = radius
        self._reach = (1 + SKIN) * radius
        self._list: tuple[_Reference, Pairs] | None = None
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
        if self._list is None:
            pairs = self._search(positions)
            usual = max(len(pairs.first), positions.shape[1])
            self._allowed = min(MOST_PAIRS, MOST_CROWDED * usual)
            self._list = _Reference(positions), pairs
        elif not self._holds(self._list[0], positions):
            self._list = _Reference(positions), self._search(positions)
        return self._list[1]

    def _holds(self, reference: _Reference, positions: Floats) -> bool:
        """Whether no two points that were out of reach can be within the radius now."""
        bounds = (reference.least_distance, reference.least_distance_if_affine)
        return any(bound(positions, self._reach) > self._radius for bound in bounds)

    def _search(self, positions: Floats) -> Pairs:
        n = positions.shape[1]
        # A body that has blown up has no neighbours; whoever stepped it finds out next.
        if not np.isfinite(np.vdot(positions, positions)):
            nobody = np.empty(0, dtype=np.int64)
            return Pairs(nobody, nobody)
        tree = cKDTree(positions.T)
        if n * (n - 1) // 2 > self._allowed:
            count = (int(tree.count_neighbors(tree, self._reach)) - n) // 2
            if count > self._allowed:
                raise CrowdedError(count, n, self._radius)
        pairs = tree.query_pairs(self._reach, output_type="ndarray").astype(np.int64)
        first, second = np.divmod(np.sort(pairs[:, 0] * n + pairs[:, 1]), n)
        return Pairs(first, second)


class _Reference:
    """Positions at which a list was made, m, shape (3, n)."""

    def __init__(self, positions: Floats) -> None:
        self._positions = positions
        self._centred = positions - positions.mean(axis=1, keepdims=True)
        self._inverse = np.linalg.pinv(self._centred @ self._centred.T)

    def least_distance(self, positions: Floats, apart: float) -> float:
        """Lower bound of the distance, m, of two points that were at least `apart` here."""
        return apart - 2 * _farthest(positions - self._positions)

    def least_distance_if_affine(self, positions: Floats, apart: float) -> float:
        """Another one, which a body that breathes or turns does not lower.

        The motion since is split into an affine map, which shortens no distance by more than its
        smallest stretch, and the rest.
        """
        centred = positions - positions.mean(axis=1, keepdims=True)
        affine = centred @ self._centred.T @ self._inverse
        if not np.isfinite(affine).all():
            return 0.0
        stretch = float(np.linalg.svd(affine, compute_uv=False)[-1])
        return stretch * apart - 2 * _farthest(centred - affine @ self._centred)


def _farthest(moves: Floats) -> float:
    """Largest length of the columns of a (3, n) array."""
    return math.sqrt(np.einsum("cn,cn->n", moves, moves).max())
