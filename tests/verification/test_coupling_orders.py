"""Orders of the coupling algorithms on a lung with a closed form.

Each participant is exact under held inputs, so the error is that of the coupling alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from cosim import (
    Adaptive,
    Connection,
    EventLocating,
    GaussSeidel,
    Iterated,
    Jacobi,
    cosimulate,
)
from cosim.algorithms import Algorithm
from tests.cosim.compartments import C1, C2, R1, R2, WIRES, SeriesLung, closed_form
from tests.cosim.helpers import Switch

DURATION = 2.0  # s: the inhalation
COUNTS = np.array([64, 128, 256, 512])  # from 2.7 steps in the shortest time constant on
SOLUTION = closed_form(DURATION)
ORDERS = {"constant": 1, "linear": 2, "quadratic": 3}
TURNS = {"downstream": (0, 1, 2), "upstream": (2, 1, 0)}


def error(algorithm: Algorithm, steps: int, turn: str = "downstream", **spoilt: Any) -> float:
    """Error of the pressures at the end, cmH2O."""
    lung = SeriesLung.new()
    vars(lung.alveoli).update(spoilt)
    participants = [lung.participants[i] for i in TURNS[turn]]
    list(cosimulate(participants, WIRES, step=DURATION / steps, steps=steps, algorithm=algorithm))
    return float(np.abs(lung.pressures - SOLUTION).max())


def slope(algorithm: Algorithm, turn: str = "downstream", **spoilt: Any) -> float:
    errors = [error(algorithm, int(steps), turn, **spoilt) for steps in COUNTS]
    return float(-np.polyfit(np.log(COUNTS), np.log(errors), 1)[0])


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("extrapolation", ORDERS)
@pytest.mark.parametrize("kind", [GaussSeidel, Jacobi, Iterated])
def test_the_order_is_one_more_than_the_degree(kind: Any, extrapolation: str, turn: str) -> None:
    method = kind(extrapolation=extrapolation)
    assert method.order == ORDERS[extrapolation]
    # The next order shows at the longest step, where it is a fifth of the error or less. Over a
    # range of 8 in the step that bends the line by log(1.2)/log(8) = 0.09.
    assert slope(method, turn) == pytest.approx(ORDERS[extrapolation], abs=0.09)


def test_the_first_step_spoils_a_parabola_that_cannot_begin_again() -> None:
    """One step with an error of second order, of which the constant is small, stays behind."""
    method = Jacobi("quadratic")
    again, once = (
        np.array([error(method, int(n), can_get_and_set_state=can) for n in COUNTS])
        for can in (True, False)
    )
    left = np.abs(once - again)
    assert (left > 0).all()
    # The pressure of the mouth starts as t², so what is left is of third order here, too.
    assert (left < again).all()


def test_the_iterated_step_does_not_depend_on_who_goes_first() -> None:
    down, up = (error(Iterated(tolerance=1e-12), 32, turn) for turn in TURNS)
    # Both solve the same equations, to the tolerance times 15 cmH2O in each of 32 steps.
    assert down == pytest.approx(up, abs=32 * 15 * 1e-12)


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi", "iterated"])
@pytest.mark.parametrize("extrapolation", ["constant", "linear"])
def test_the_error_of_variable_steps_follows_their_tolerance(
    method: Any, extrapolation: Any
) -> None:
    tolerances = np.geomspace(1e-3, 3e-6, 6)
    errors = [error(Adaptive(tol, method, extrapolation), 8) for tol in tolerances]
    fit = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    order = ORDERS[extrapolation]
    # A step of length h errs by h^(p+1) and there are 1/h of them: the error of the whole goes as
    # tolerance^(p/(p+1)). Parts are halved and never thirded, which scatters each error by 2^p.
    assert fit == pytest.approx(order / (order + 1), abs=0.12)


def test_variable_steps_are_short_where_the_solution_is_fast() -> None:
    """After a sudden start, long steps come back."""
    lung = SeriesLung.new()
    lung.airways.p = 15.0  # relaxes within 0.08 s, and then follows slowly
    taken: list[tuple[float, float]] = []
    step = lung.alveoli.step
    vars(lung.alveoli)["step"] = lambda time, part: (taken.append((time, part)), step(time, part))
    list(
        cosimulate(
            lung.participants, WIRES, step=0.25, steps=8, algorithm=Adaptive(1e-3, "iterated")
        )
    )
    early = min(part for time, part in taken if time < 0.1)
    late = max(part for time, part in taken if time > 0.5)
    # The error of a part is of third order: the third derivative falls from 15/0.08³ to 7.5 (2π/4)³
    # cmH2O/s³, so parts grow tenfold, rounded to powers of two at both ends.
    assert late >= 4 * early


@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi", "iterated"])
def test_variable_steps_leave_communication_points_alone(method: Any) -> None:
    def times(algorithm: Algorithm) -> list[float]:
        points = cosimulate(
            SeriesLung.new().participants, WIRES, step=1 / 30, steps=30, algorithm=algorithm
        )
        return [point.time for point in points]

    assert (
        times(Adaptive(1e-5, method)) == times(GaussSeidel()) == [i * (1 / 30) for i in range(31)]
    )


@pytest.mark.parametrize("extrapolation", ORDERS)
@pytest.mark.parametrize("relaxation", ["aitken", "quasi-newton"])
def test_every_relaxation_finds_the_same_step(relaxation: Any, extrapolation: Any) -> None:
    found = [error(Iterated(1e-12, 100, kind, extrapolation), 64) for kind in ("none", relaxation)]
    assert found[0] == pytest.approx(found[1], abs=64 * 15 * 1e-12)  # as above


MOMENT = 2 / 3  # s: off the communication points, two thirds of a step behind one
AROUND = np.array([128, 512])  # at both


def switched(algorithm: Algorithm, steps: int) -> float:
    """Error, cmH2O, in a lung at rest where the mouth goes from 0 to 10 cmH2O at MOMENT."""
    lung, switch = SeriesLung.new(), Switch(MOMENT)
    wires = [Connection("switch.y", "airways.p_mouth"), *WIRES[1:]]
    participants = [switch, lung.airways, lung.alveoli]
    step = DURATION / steps
    list(cosimulate(participants, wires, step=step, steps=steps, algorithm=algorithm))
    a = np.array([[-(1 / R1 + 1 / R2) / C1, 1 / R2 / C1], [1 / R2 / C2, -1 / R2 / C2]])
    # At rest all pressures are that of the mouth.
    solution = 10 - expm(a * (DURATION - MOMENT)) @ [10.0, 10.0]
    return float(np.abs(lung.pressures - solution).max())


@pytest.mark.parametrize("extrapolation", ORDERS)
@pytest.mark.parametrize("method", ["gauss-seidel", "jacobi", "iterated"])
def test_a_located_event_keeps_the_order(method: Any, extrapolation: Any) -> None:
    # The bracket leaves an error of 1e-11 s times 100 cmH2O/s, far below that of the coupling.
    algorithm = EventLocating(1e-11, method, extrapolation)
    errors = [switched(algorithm, int(steps)) for steps in AROUND]
    order = -np.diff(np.log(errors)) / np.diff(np.log(AROUND))
    assert algorithm.order == ORDERS[extrapolation]
    # Without location it is 1 for all. The next order bends the line as above.
    assert order == pytest.approx(algorithm.order, abs=0.09)
