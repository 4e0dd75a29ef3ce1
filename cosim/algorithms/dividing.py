"""What algorithms share that divide communication steps, and let another one take the parts."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Final, Literal

from cosim.algorithms.algorithm import Algorithm
from cosim.algorithms.gauss_seidel import GaussSeidel
from cosim.algorithms.iterated import Iterated
from cosim.algorithms.jacobi import Jacobi
from cosim.algorithms.signals import Extrapolation

Method = Literal["gauss-seidel", "jacobi", "iterated"]

_METHODS: Final[dict[str, type[GaussSeidel | Jacobi | Iterated]]] = {
    kind.name: kind for kind in (GaussSeidel, Jacobi, Iterated)
}


@dataclass(frozen=True)
class Dividing(Algorithm):
    """Divides steps; a subclass has the fields `method` and `extrapolation`."""

    goes_back: ClassVar[bool] = True
    divides: ClassVar[bool] = True

    @property
    @abstractmethod
    def inner(self) -> Algorithm:
        """Who takes the parts."""

    @property
    def order(self) -> int:
        """That of the method, at parts of one length."""
        return self.inner.order

    @property
    def in_turn(self) -> bool:
        """Whether the method goes in turn."""
        return self.inner.in_turn


def algorithm_of(method: Method, extrapolation: Extrapolation) -> Algorithm:
    """Make the algorithm of that name."""
    return _METHODS[method](extrapolation=extrapolation)
