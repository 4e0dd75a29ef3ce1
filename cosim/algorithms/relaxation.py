"""How an iteration goes on from what it gave and what came back."""

from __future__ import annotations

from typing import Final, Literal, Protocol

from softbody_core.ground.anderson import Anderson
from softbody_core.ground.arrays import Floats

Relaxation = Literal["none", "aitken", "quasi-newton"]

_MEMORY: Final = 8
"""Earlier passes that the quasi-Newton method looks at."""


class Relaxing(Protocol):
    """Finds x with d(x) = 0 from values of d."""

    def next(self, x: Floats, d: Floats) -> Floats:
        """Where to look next, given d at x."""
        ...


class _Plain:
    """Fixed-point iteration."""

    def next(self, x: Floats, d: Floats) -> Floats:
        return x + d


class _Aitken:
    """Dynamic relaxation by Aitken's Δ² for vectors (Irons & Tuck 1969; Küttler & Wall 2008)."""

    def __init__(self) -> None:
        self._factor = 1.0
        self._last: Floats | None = None

    def next(self, x: Floats, d: Floats) -> Floats:
        if self._last is not None:
            change = d - self._last
            square = float(change @ change)
            if square > 0:
                self._factor *= -float(self._last @ change) / square
        self._last = d
        return x + self._factor * d


def relaxing(kind: Relaxation) -> Relaxing:
    """Start an iteration.

    "none" is a fixed-point iteration, "aitken" stretches each move by one factor, "quasi-newton"
    combines the earlier moves by least squares (Anderson; in partitioned coupling IQN-ILS, Degroote
    et al. 2009).
    """
    if kind == "none":
        return _Plain()
    return _Aitken() if kind == "aitken" else Anderson(_MEMORY)
