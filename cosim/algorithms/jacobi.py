"""Jacobi coupling."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from cosim.algorithms.explicit import Explicit


@dataclass(frozen=True)
class Jacobi(Explicit):
    """All at once: everyone sees what the others gave at the start of the step.

    The order does not matter. A connection that is held lags by one communication step.

    Parameters
    ----------
    extrapolation : str
        How continuous outputs go on over a step: "constant", "linear" or "quadratic".
    """

    name: ClassVar[str] = "jacobi"

    @property
    def in_turn(self) -> bool:
        """Nobody sees what another has just computed."""
        return False
