"""Gauss-Seidel coupling."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from cosim.algorithms.explicit import Explicit


@dataclass(frozen=True)
class GaussSeidel(Explicit):
    """One after the other, in the order given: each sees what those before it have just computed.

    With the controller first, a body feels the controller's answer to the volume that it has now.

    Parameters
    ----------
    extrapolation : str
        How continuous outputs go on over a step: "constant", "linear" or "quadratic".
    """

    name: ClassVar[str] = "gauss-seidel"
