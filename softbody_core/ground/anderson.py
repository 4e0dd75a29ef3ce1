"""Anderson acceleration of a fixed-point iteration (Walker & Ni 2011, algorithm AA)."""

from __future__ import annotations

import numpy as np

from softbody_core.ground.arrays import Floats

_REGULARIZATION = 1e-10
"""Of the squared length of each difference: keeps directions that repeat from being amplified."""


class Anderson:
    """Finds x with d(x) = 0 from values of d, by the step that the last few of them suggest.

    Parameters
    ----------
    memory : int
        Earlier values that are kept.
    """

    def __init__(self, memory: int) -> None:
        self._memory = memory
        self._last: tuple[Floats, Floats] | None = None
        self._moves: list[Floats] = []
        self._changes: list[Floats] = []

    def next(self, x: Floats, d: Floats) -> Floats:
        """Where to look next, given d at x; of the same shape as x."""
        if self._last is not None:
            self._moves.append(x - self._last[0])
            self._changes.append(d - self._last[1])
            del self._moves[: -self._memory], self._changes[: -self._memory]
        self._last = x, d
        ahead = x + d
        for weight, move, change in zip(self._weights(d), self._moves, self._changes, strict=True):
            ahead -= weight * (move + change)
        return ahead

    def _weights(self, d: Floats) -> Floats:
        """Least-squares combination of the changes that makes up d."""
        if not self._changes:
            return np.empty(0)
        changes = np.array([change.ravel() for change in self._changes])
        gram = changes @ changes.T
        sizes = np.maximum(np.sqrt(np.diag(gram)), np.finfo(np.float64).tiny)
        scaled = gram / np.outer(sizes, sizes) + _REGULARIZATION * np.eye(len(sizes))
        return np.asarray(np.linalg.solve(scaled, changes @ d.ravel() / sizes) / sizes)
