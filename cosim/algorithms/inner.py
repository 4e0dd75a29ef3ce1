"""Which algorithm takes the steps of one that divides them."""

from __future__ import annotations

from typing import Literal

from cosim.algorithms.algorithm import Algorithm
from cosim.algorithms.gauss_seidel import GaussSeidel
from cosim.algorithms.iterated import Iterated
from cosim.algorithms.jacobi import Jacobi
from cosim.algorithms.signals import Extrapolation

Method = Literal["gauss-seidel", "jacobi", "iterated"]


def inner(method: Method, extrapolation: Extrapolation) -> Algorithm:
    """Make the algorithm of that name."""
    if method == "iterated":
        return Iterated(extrapolation=extrapolation)
    return (GaussSeidel if method == "gauss-seidel" else Jacobi)(extrapolation)
