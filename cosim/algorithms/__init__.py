"""Coupling algorithms: who steps when, and with which inputs.

A new algorithm is one file here and one line in `ALGORITHMS`.
"""

from typing import Final

from cosim.algorithms.adaptive import Adaptive
from cosim.algorithms.algorithm import Algorithm, Coupler
from cosim.algorithms.event_locating import EventLocating
from cosim.algorithms.gauss_seidel import GaussSeidel
from cosim.algorithms.iterated import Iterated
from cosim.algorithms.jacobi import Jacobi

ALGORITHMS: Final[dict[str, type[Algorithm]]] = {
    kind.name: kind
    for kind in (
        GaussSeidel,
        Jacobi,
        Iterated,
        Adaptive,
        EventLocating,
    )
}

__all__ = [
    "ALGORITHMS",
    "Adaptive",
    "Algorithm",
    "Coupler",
    "EventLocating",
    "GaussSeidel",
    "Iterated",
    "Jacobi",
]
