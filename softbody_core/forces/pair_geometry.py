"""What lies between neighbouring points, and sums over neighbours, without new arrays."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from softbody_core.configuration import norms, scatter, take
from softbody_core.ground.arrays import Floats
from softbody_core.mesh import difference_operator, per_component
from softbody_core.neighbours import Pairs


class PairGeometry:
    """Arrays and operators of one list of pairs.

    Parameters
    ----------
    pairs : Pairs
        The list.
    n_points : int
        Number of points.
    radius : float
        h_w, m.

    Attributes
    ----------
    vectors : ndarray, shape (3, p)
        x_j − x_i, m.
    lengths : ndarray, shape (p,)
        r, m; never quite 0, so that points at one place push each other nowhere.
    gap : ndarray, shape (p,)
        h_w − r, m; 0 beyond the radius.
    weights : ndarray, shape (p,)
        To be filled before `neighbour_sum`.
    velocities : ndarray, shape (3, p)
        Room for differences of velocity, m/s.
    """

    def __init__(self, pairs: Pairs, n_points: int, radius: float) -> None:
        p = len(pairs.first)
        self.pairs = pairs
        self.vectors, self.velocities = np.empty((2, 3, p))
        self.lengths, self.gap, self._a, self._b = np.empty((4, p))
        self._radius = radius
        # In lexicographic order the pairs are the rows of an upper triangular matrix.
        rows = np.searchsorted(pairs.first, np.arange(n_points + 1)).astype(np.int32)
        self._followers = np.diff(rows)  # pairs that a point is the first of
        entries = (np.zeros(p), pairs.second.astype(np.int32), rows)
        self._to_first = sp.csr_array(entries, shape=(n_points, n_points))
        self._to_second = sp.csc_array(entries, shape=(n_points, n_points))
        self.weights = self._to_first.data = self._to_second.data
        differences = difference_operator(np.stack(pairs, axis=1), n_points)
        self._onto_ends = per_component(differences.T.tocsr())

    def move_to(self, positions: Floats) -> None:
        """Look at other positions, m, shape (3, n)."""
        self.differences(positions, self.vectors)
        norms(self.vectors, self.lengths)
        np.maximum(self.lengths, np.finfo(np.float64).tiny, out=self.lengths)
        np.subtract(self._radius, self.lengths, out=self.gap)
        np.maximum(self.gap, 0.0, out=self.gap)

    def differences(self, values: Floats, out: Floats) -> Floats:
        """Values at the second point less those at the first, shape (3, p)."""
        take(values, self.pairs.second, out)
        out -= np.repeat(values, self._followers, axis=1)
        return out

    def at_ends(self, values: Floats) -> tuple[Floats, Floats]:
        """Values of shape (n,) at both points of each pair; overwritten by the next call."""
        values.take(self.pairs.first, out=self._a, mode="clip")
        values.take(self.pairs.second, out=self._b, mode="clip")
        return self._a, self._b

    def neighbour_sum(self, values: Floats) -> Floats:
        """Σ_j w_ij · values_j with the weights as they stand; values of shape (n,)."""
        total: Floats = self._to_first @ values
        total += self._to_second @ values
        return total

    def totals(self, values: Floats) -> Floats:
        """Sum of the values of each point's pairs, shape (n,)."""
        self.weights[:] = values
        return self.neighbour_sum(np.ones(self._to_first.shape[0]))

    def onto_ends(self, carried: Floats) -> Floats:
        """What pairs carry, shape (3, p), added at their second points and taken from the first."""
        return scatter(self._onto_ends, carried)
