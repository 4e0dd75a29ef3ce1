from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

import cosim
from cosim import (
    ALGORITHMS,
    Adaptive,
    Connection,
    CoSimulation,
    CouplingError,
    EventLocating,
    FmuParticipant,
    GaussSeidel,
    Iterated,
    Jacobi,
    WiringError,
    cosimulate,
)
from cosim.algorithms import Algorithm
from cosim.algorithms.signals import held_weights
from cosim.fmu.isolation import ISOLATIONS, open_fmu
from cosim.participant import Causality, Variability
from tests.cosim.compartments import WIRES as SERIES
from tests.cosim.compartments import SeriesLung
from tests.cosim.foreign import STATES
from tests.cosim.helpers import Lung, Relaxation, Sink, Source, Switch, port, with_extrapolation

# x' = A x, one participant a row.
A = np.array([[-1.0, 0.5], [0.8, -2.0]])
X0 = np.array([1.0, -0.5])
WIRES = [Connection("second.x", "first.u"), Connection("first.x", "second.u")]

OPTIONS: dict[str, dict[str, Any]] = {"adaptive": {"tolerance": 10.0}}
"""Options under which all steps are of one length, where a tolerance decides on that."""

DOCS = Path(__file__).parents[2] / "docs" / "coupling.md"


def coupled(algorithm: Algorithm, steps: int, order: tuple[int, int] = (0, 1)) -> np.ndarray:
    """State at t = 1 of the two participants, stepped in the given order."""
    pair = [
        Relaxation("first", A[0, 0], A[0, 1], X0[0]),
        Relaxation("second", A[1, 1], A[1, 0], X0[1]),
    ]
    stepped = [*(pair[i] for i in order), Switch(0.25)]
    list(cosimulate(stepped, WIRES, step=1 / steps, steps=steps, algorithm=algorithm))
    return np.array([participant.x for participant in pair])


def exact_step(row: int, x: float, u: float) -> float:
    rate, gain = A[row, row], A[row, 1 - row]
    return math.exp(rate) * x + (math.exp(rate) - 1) / rate * gain * u


@pytest.mark.parametrize("name", ALGORITHMS)
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_error_shrinks_at_the_declared_order(name: str, order: tuple[int, int]) -> None:
    counts = np.array([16, 32, 64, 128])
    solution = expm(A) @ X0
    algorithm = ALGORITHMS[name](**OPTIONS.get(name, {}))
    errors = [np.linalg.norm(coupled(algorithm, int(n), order) - solution) for n in counts]
    slope = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    # The next order shows at 16 steps.
    assert slope == pytest.approx(algorithm.order, abs=0.1), (
        f"{name} says that its order is {algorithm.order}, and errors shrink at {slope:.2f}: "
        "correct `order`; or, if it divides steps by a tolerance, add options to OPTIONS in "
        "tests/cosim/test_algorithms.py under which it does not"
    )


@pytest.mark.parametrize("name", ALGORITHMS)
def test_an_algorithm_is_exported_and_documented(name: str) -> None:
    kind = ALGORITHMS[name].__name__
    for package, file in ((cosim.algorithms, "algorithms/__init__.py"), (cosim, "__init__.pyi")):
        assert kind in package.__all__, (
            f"{kind} is in ALGORITHMS and not exported by cosim/{file}: import it there, and add "
            "it to its __all__"
        )
    text = DOCS.read_text(encoding="utf-8")
    row = next((line for line in text.splitlines() if line.startswith(f"| `{name}` | ")), "")
    assert row, (
        f'docs/coupling.md: expected a row "| `{name}` | what it does | its options |" in the '
        "table of algorithms"
    )
    for option in fields(ALGORITHMS[name]()):
        assert f"`{option.name}` = " in row, (
            f"docs/coupling.md, row `{name}`: option `{option.name}` and its default are missing"
        )


def test_gauss_seidel_passes_on_what_was_just_computed() -> None:
    first = exact_step(0, X0[0], X0[1])
    second = exact_step(1, X0[1], first)
    # The helper's formula, with one rounding more or less.
    assert coupled(GaussSeidel(), 1) == pytest.approx([first, second], rel=1e-14)


def test_jacobi_passes_on_the_start_of_the_step() -> None:
    expected = [exact_step(0, X0[0], X0[1]), exact_step(1, X0[1], X0[0])]
    assert coupled(Jacobi(), 1) == pytest.approx(expected, rel=1e-14)


def test_order_of_participants_matters_to_gauss_seidel_alone() -> None:
    first, other = (coupled(GaussSeidel(), 16, order) for order in [(0, 1), (1, 0)])
    assert np.abs(first - other).max() > 1e-3  # about the coupling error itself
    first, other = (coupled(Jacobi(), 16, order) for order in [(0, 1), (1, 0)])
    assert np.array_equal(first, other)


def test_an_iterated_step_solves_for_its_own_end() -> None:
    """One step of 1 s: each is exact under the mean of the other's start and end."""
    end = coupled(Iterated(tolerance=1e-13), 1)
    middle = (X0 + end) / 2
    expected = [exact_step(0, X0[0], middle[1]), exact_step(1, X0[1], middle[0])]
    assert end == pytest.approx(expected, rel=1e-12)  # ten times the tolerance


@given(
    st.lists(st.integers(-40, 10), min_size=1, max_size=3, unique=True),
    st.lists(st.floats(-10, 10), min_size=3, max_size=3),
    st.sampled_from([1, 2]),
)
def test_what_is_held_has_the_moments_of_the_polynomial(
    tenths: list[int], coefficients: list[float], parts: int
) -> None:
    places = tuple(place / 10 for place in tenths)
    polynomial = np.polynomial.Polynomial(coefficients[: len(places)])
    values = polynomial(np.array(places))
    held = [float(np.dot(weights, values)) for weights in held_weights(places, parts)]
    # Weights reach 1000 for places a tenth apart, four steps away; values reach 200.
    slack = 1e-9
    assert np.mean(held) == pytest.approx(polynomial.integ()(1.0), abs=slack)
    if parts == 2:
        about_middle = (polynomial * np.polynomial.Polynomial([-0.5, 1.0])).integ()(1.0)
        assert (held[1] - held[0]) / 8 == pytest.approx(about_middle, abs=slack)


@pytest.mark.parametrize("name", ALGORITHMS)
@pytest.mark.parametrize("extrapolation", ["constant", "linear", "quadratic"])
def test_a_dumped_loop_goes_on_to_the_bit(name: str, extrapolation: Any) -> None:
    algorithm = ALGORITHMS[name](**with_extrapolation(name, extrapolation))

    def loop() -> tuple[SeriesLung, CoSimulation]:
        lung = SeriesLung.new()
        participants = [*lung.participants, Switch(0.512)]
        return lung, CoSimulation(participants, SERIES, step=0.1, algorithm=algorithm)

    unbroken, broken = loop(), loop()
    for _, simulation in (unbroken, broken):
        simulation.begin()
        for _ in range(5):
            simulation.advance()
    state = broken[1].serialize()
    coupler = json.loads(json.dumps(state.coupler))  # as in a file
    again, simulation = loop()
    simulation.begin()
    simulation.deserialize(type(state)(state.index, state.participants, coupler))
    for _ in range(5):
        assert simulation.advance() == unbroken[1].advance()
    assert np.array_equal(again.pressures, unbroken[0].pressures)


def refusal(name: str, **lacking: bool) -> str:
    """What an algorithm says of participants of which the second one lacks something."""
    pair = [Relaxation("first", -1.0, 0.5, 1.0), Relaxation("second", -2.0, 0.8, 1.0)]
    vars(pair[1]).update(lacking)
    stepped = [*pair, Switch(0.25)]
    loop = cosimulate(stepped, WIRES, step=0.1, steps=1, algorithm=ALGORITHMS[name]())
    try:
        next(loop)
    except CouplingError as error:
        assert pair[0].calls == []  # before anything starts
        return str(error)
    next(loop)
    return ""


@pytest.mark.parametrize("name", ALGORITHMS)
def test_who_cannot_be_rolled_back_is_named_if_need_be(name: str) -> None:
    text = refusal(name, can_get_and_set_state=False)
    assert bool(text) == ALGORITHMS[name].goes_back, (
        f"{name}.goes_back = {ALGORITHMS[name].goes_back}, and of a participant that cannot it "
        f"says {text!r}: correct it, or call `check` in `bind`"
    )
    if text:
        assert re.search(rf"{name} goes back .* second cannot .* gauss-seidel", text)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_who_cannot_vary_its_step_is_named_if_need_be(name: str) -> None:
    text = refusal(name, varies_step=False)
    assert bool(text) == ALGORITHMS[name].divides, (
        f"{name}.divides = {ALGORITHMS[name].divides}, and of a participant that cannot vary its "
        f"step it says {text!r}: correct it, or call `check` in `bind`"
    )
    if text:
        assert re.search(rf"{name} divides steps, and second cannot .* gauss-seidel", text)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_steps_are_divided_as_an_algorithm_says(name: str) -> None:
    """A part that is taken again begins where it began before, and counts once."""
    algorithm = ALGORITHMS[name](**OPTIONS.get(name, {}))
    source, sink = Counting("first", -1.0, 0.5, 1.0), Relaxation("second", -2.0, 0.8, 1.0)
    list(cosimulate([source, sink, Switch(9.0)], WIRES, step=0.1, steps=1, algorithm=algorithm))
    assert len(source.starts) == algorithm.least_parts, (
        f"{name} says that a step is taken in {algorithm.least_parts} parts, and it is in "
        f"{len(source.starts)}: correct `least_parts`"
    )
    assert algorithm.divides or algorithm.least_parts == 1


@pytest.mark.parametrize("name", ALGORITHMS)
def test_an_algorithm_goes_in_turn_if_it_says_so(name: str) -> None:
    """Who steps second sees what the first one has just computed, or does not."""
    algorithm = ALGORITHMS[name](**OPTIONS.get(name, {}))
    source, sink = Sampler(), Sink()
    source.value = 1.0
    wires = [Connection("clock.y", "sampler.u"), Connection("sampler.y", "sink.u")]
    loop = [Source(1.0, name="clock"), source, sink, Switch(9.0)]
    list(cosimulate(loop, wires, step=0.1, steps=1, algorithm=algorithm))
    assert (sink.value == -1.0) == algorithm.in_turn, (
        f"{name}.in_turn = {algorithm.in_turn}, and it is the other way round: correct it"
    )


@pytest.mark.parametrize("isolation", ISOLATIONS)
@pytest.mark.parametrize(
    ("algorithm", "message"),
    [
        (Adaptive(), r"adaptive divides steps, and controller cannot .* Take gauss-seidel, jacobi"),
        (EventLocating(), r"event-locating divides steps, and controller cannot .* gauss-seidel"),
        (GaussSeidel("quadratic"), r'"quadratic" divides steps, and controller .* or "linear"'),
        (Iterated(extrapolation="quadratic"), r'"quadratic" divides steps, and controller'),
    ],
)
def test_a_fixed_step_is_not_divided(
    foreign: Callable[..., Path], isolation: str, algorithm: Algorithm, message: str
) -> None:
    flags = f'{STATES} canHandleVariableCommunicationStepSize="false"'
    path = foreign(2, "STEP_LENGTH=0.1", flags=flags, experiment='stepSize="0.1"')
    wires = [Connection("source.y", "controller.volume")]

    def clock(algorithm: Algorithm) -> float:
        fmu = open_fmu(path, "controller", {}, isolation=isolation)
        try:
            loop = cosimulate(
                [Source(1e-3, "m3"), fmu], wires, step=0.1, steps=2, algorithm=algorithm
            )
            return [point.outputs["controller"]["clock"] for point in loop][-1]
        finally:
            fmu.close()

    with pytest.raises(CouplingError, match=message):
        clock(algorithm)
    if isolation == "none":  # processes take their time to start
        for advised in (GaussSeidel("linear"), Jacobi(), Iterated()):
            assert clock(advised) == 0.2


def test_an_iteration_that_does_not_converge_names_what_changes() -> None:
    """x' = −x + 50 u both ways: the exchange of one step of 1 s grows 16-fold a pass."""
    pair = [Relaxation("first", -1.0, 50.0, 1.0), Relaxation("second", -1.0, 50.0, 1.0)]
    loop = cosimulate(
        pair, WIRES, step=1.0, steps=1, algorithm=Iterated(max_iterations=6, relaxation="none")
    )
    next(loop)
    with pytest.raises(
        CouplingError, match=r"t = 0 s by 1 s .* after 6 passes second\.x"
    ) as message:
        next(loop)
    assert "Try" in str(message.value)
    assert [participant.x for participant in pair] == [1.0, 1.0]  # back at the start


@pytest.mark.parametrize("relaxation", ["aitken", "quasi-newton"])
def test_relaxation_converges_where_the_plain_iteration_grows(relaxation: Any) -> None:
    pair = [Relaxation("first", -1.0, 50.0, 1.0), Relaxation("second", -1.0, 50.0, 1.0)]
    solver = Iterated(tolerance=1e-10, relaxation=relaxation)
    list(cosimulate(pair, WIRES, step=1.0, steps=1, algorithm=solver))
    # x = e⁻¹ + 50 (1 − e⁻¹)(1 + x)/2 for both
    decay, half = math.exp(-1), 25 * (1 - math.exp(-1))
    expected = (decay + half) / (1 - half)
    assert [p.x for p in pair] == pytest.approx([expected] * 2, rel=1e-8)


class Counting(Relaxation):
    """Keeps when it was stepped, whatever is undone."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.starts: set[float] = set()

    def step(self, time: float, step: float) -> None:
        self.starts.add(round(time, 9))
        super().step(time, step)


class Sampler(Sink):
    """Passes on what it finds at its input at the start of a step."""

    def __init__(self) -> None:
        super().__init__(name="sampler")
        self.ports = {
            "u": port("u", "1", Causality.INPUT),
            "y": port("y", "1", Causality.OUTPUT, variability=Variability.SAMPLED),
        }
        self.y = 0.0

    def step(self, time: float, step: float) -> None:
        self.y = -self.value

    def read(self) -> Mapping[str, float]:
        return {"y": self.y}


@pytest.mark.parametrize("extrapolation", ["constant", "linear", "quadratic"])
def test_a_sampled_controller_takes_the_start_of_the_step(extrapolation: Any) -> None:
    """Nothing is extrapolated for it, or from it; iterated, its place in the order is all one."""
    wires = [Connection("plant.x", "sampler.u"), Connection("sampler.y", "plant.u")]

    def end(algorithm: Algorithm, *, first: bool) -> tuple[float, int]:
        plant = Relaxation("plant", -1.0, 0.5, 1.0)
        participants = [Sampler(), plant] if first else [plant, Sampler()]
        list(cosimulate(participants, wires, step=0.1, steps=10, algorithm=algorithm))
        return plant.x, sum(call == "step" for call, _ in plant.calls)

    held, steps = end(GaussSeidel(), first=True)
    assert steps == 10
    assert end(GaussSeidel(extrapolation), first=True) == (held, 10)
    assert end(Iterated(extrapolation=extrapolation), first=True) == (held, 10)  # nothing to repeat
    assert end(Iterated(extrapolation=extrapolation), first=False)[0] == held


@pytest.mark.parametrize("at_start", [True, False])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
@given(moment=st.floats(0.01, 0.95))
def test_an_event_is_located_to_the_tolerance(
    at_start: bool, tolerance: float, moment: float
) -> None:
    switch, lung = Switch(moment, at_start=at_start), Lung(10.0, 0.1)
    wire = Connection("switch.y", "lung.p")
    locating = EventLocating(tolerance=tolerance)
    points = list(cosimulate([switch, lung], [wire], step=0.1, steps=10, algorithm=locating))
    assert [point.time for point in points] == [i * 0.1 for i in range(11)]
    # V = C p (1 − e^(−(t − moment)/RC)) with RC = 1 s, C p = 1 L: late or early by two brackets
    # (bisection, and the step in which the mode is seen) it errs by at most twice the tolerance.
    assert lung.volume == pytest.approx(1 - math.exp(moment - 1), abs=2.01 * tolerance)


def test_an_event_on_a_communication_point_divides_no_step() -> None:
    """The halves that bisection tries leave no trace."""
    ends = []
    for algorithm in (EventLocating(), GaussSeidel()):
        switch, lung = Switch(0.5, at_start=True), Lung(10.0, 0.1)
        wire = Connection("switch.y", "lung.p")
        list(cosimulate([switch, lung], [wire], step=0.125, steps=8, algorithm=algorithm))
        ends.append(lung.volume)
    assert ends[0] == ends[1]


def test_chatter_is_an_error() -> None:
    class Chattering(Switch):
        def step(self, time: float, step: float) -> None:
            self.on = float(math.floor((time + step) * 77))

    loop = cosimulate([Chattering(0.0)], [], step=1.0, steps=1, algorithm=EventLocating())
    next(loop)
    with pytest.raises(CouplingError, match="more than 10 events"):
        next(loop)


def test_without_a_mode_there_is_no_event_to_locate() -> None:
    with pytest.raises(CouplingError, match="no event to locate"):
        next(cosimulate([Source(1.0)], [], step=1.0, steps=1, algorithm=EventLocating()))


def test_an_error_that_no_division_brings_down_is_named() -> None:
    class Noisy(Relaxation):
        def step(self, time: float, step: float) -> None:
            self.x = 1.0 + math.sin(1e6 * step)

    pair = [Noisy("first", 0.0, 0.0, 1.0), Relaxation("second", -1.0, 1.0, 1.0)]
    loop = cosimulate(pair, WIRES, step=1.0, steps=1, algorithm=Adaptive(1e-6))
    next(loop)
    with pytest.raises(CouplingError, match=r"at t = 0 s a part of .* errs by .* Raise tolerance"):
        next(loop)


def test_a_real_ventilator_switches_between_communication_points(pressure: Path) -> None:
    """Square wave on R = 10, C = 0.1 from rest: V = C ΔP (1 − e^(−Ti/RC)) e^(−(t − Ti)/RC)."""
    inhaled, step = 1.5123, 1 / 30

    def volume(algorithm: Algorithm) -> float:
        parameters = {"peep": "0 cmH2O", "driving_pressure": "10 cmH2O"}
        fmu = FmuParticipant(
            pressure, parameters={**parameters, "inspiratory_time": f"{inhaled} s"}
        )
        lung = Lung(10.0, 0.1)
        try:
            wires = [Connection("controller.delta_p", "lung.p")]
            list(cosimulate([fmu, lung], wires, step=step, steps=60, algorithm=algorithm))
        finally:
            fmu.close()
        return lung.volume

    expected = (1 - math.exp(-inhaled)) * math.exp(inhaled - 2.0)
    assert abs(volume(GaussSeidel()) - expected) > 1e-2  # late by up to a step of 33 ms
    # Within two brackets of 1e-5 s, at a flow of 1 L/s.
    assert volume(EventLocating(tolerance=1e-5)) == pytest.approx(expected, abs=2e-5)


def test_several_outputs_add_up_in_the_unit_of_the_input() -> None:
    sources = [Source(1.0, "L", "left"), Source(500.0, "mL", "right")]
    sink = Sink("L")
    wire = Connection("left.y", "sink.u", added=("right.y",))
    assert str(wire) == "left.y + right.y → sink.u"
    list(cosimulate([*sources, sink], [wire], step=1.0, steps=1))
    assert sink.value == pytest.approx(1.5, rel=1e-15)  # one rounding


@pytest.mark.parametrize(
    ("units", "target", "message"),
    [
        (("L", "cmH2O"), "L", "'cmH2O' cannot be converted to 'L'"),
        (("degC", "degC"), "K", "with an offset cannot be added"),
        (("L", None), "L", r"right\.y declares no unit"),
    ],
)
def test_what_cannot_be_added_is_refused(
    units: tuple[str | None, str | None], target: str, message: str
) -> None:
    sources = [
        Source(1.0, symbol, name) for symbol, name in zip(units, ("left", "right"), strict=True)
    ]
    with pytest.raises(WiringError, match=message):
        next(
            cosimulate(
                [*sources, Sink(target)],
                [Connection("left.y", "sink.u", added=("right.y",))],
                step=1.0,
                steps=1,
            )
        )
