from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from cosim import ALGORITHMS, Connection, cosimulate
from cosim.algorithms import Algorithm, GaussSeidel, Jacobi
from tests.cosim.helpers import Relaxation

# x' = A x, one participant a row.
A = np.array([[-1.0, 0.5], [0.8, -2.0]])
X0 = np.array([1.0, -0.5])
WIRES = [Connection("second.x", "first.u"), Connection("first.x", "second.u")]


def coupled(algorithm: Algorithm, steps: int, order: tuple[int, int] = (0, 1)) -> np.ndarray:
    """State at t = 1 of the two participants, stepped in the given order."""
    pair = [
        Relaxation("first", A[0, 0], A[0, 1], X0[0]),
        Relaxation("second", A[1, 1], A[1, 0], X0[1]),
    ]
    stepped = [pair[i] for i in order]
    list(cosimulate(stepped, WIRES, step=1 / steps, steps=steps, algorithm=algorithm))
    return np.array([participant.x for participant in pair])


def exact_step(row: int, x: float, u: float) -> float:
    rate, gain = A[row, row], A[row, 1 - row]
    return math.exp(rate) * x + (math.exp(rate) - 1) / rate * gain * u


@pytest.mark.parametrize("name", ALGORITHMS)
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_error_shrinks_at_first_order(name: str, order: tuple[int, int]) -> None:
    counts = np.array([16, 32, 64, 128])
    solution = expm(A) @ X0
    errors = [np.linalg.norm(coupled(ALGORITHMS[name](), int(n), order) - solution) for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.1)  # the next order still shows at 16 steps


def test_gauss_seidel_passes_on_what_was_just_computed() -> None:
    first = exact_step(0, X0[0], X0[1])
    second = exact_step(1, X0[1], first)
    # The helper's formula, with one rounding more or less.
    assert coupled(GaussSeidel(), 1) == pytest.approx([first, second], rel=1e-14)


def test_jacobi_passes_on_the_start_of_the_step() -> None:
    expected = [exact_step(0, X0[0], X0[1]), exact_step(1, X0[1], X0[0])]
    assert coupled(Jacobi(), 1) == pytest.approx(expected, rel=1e-14)


def test_order_of_participants_matters_to_gauss_seidel_alone() -> None:
    one, other = (coupled(GaussSeidel(), 16, order) for order in [(0, 1), (1, 0)])
    assert np.abs(one - other).max() > 1e-3  # about the coupling error itself
    one, other = (coupled(Jacobi(), 16, order) for order in [(0, 1), (1, 0)])
    assert np.array_equal(one, other)
