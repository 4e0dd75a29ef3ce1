from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from fmpy.validation import validate_fmu
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim import ControllerError, FmuError, FmuParticipant, quantity
from cosim.controllers import CONTROLLERS, build, controller_fmu, controller_source
from cosim.participant import Causality
from tests.cosim.helpers import Lung, breathe, description, variable

DOCS = Path(__file__).parents[2] / "docs" / "controller.md"
FRAMES = 120
FRAME = 4.0 / FRAMES
Volume = Callable[[int], float]


# Conformance: what every controller that ships has to keep to.


@pytest.mark.parametrize("name", CONTROLLERS)
def test_validator_finds_nothing(shipped: Mapping[str, Path], name: str) -> None:
    assert validate_fmu(str(shipped[name])) == []


@pytest.mark.parametrize("name", CONTROLLERS)
def test_second_build_gives_the_same_bytes(
    shipped: Mapping[str, Path], tmp_path: Path, name: str
) -> None:
    again = build(controller_source(name), tmp_path / "again.fmu")
    assert again.read_bytes() == shipped[name].read_bytes()


@pytest.mark.parametrize("name", CONTROLLERS)
def test_description_says_what_other_tools_need(shipped: Mapping[str, Path], name: str) -> None:
    root = description(shipped[name])
    assert len(root.get("guid", "")) == 38  # a UUID in braces
    assert root.find("CoSimulation").get("needsExecutionTool") == "false"
    assert root.find("DefaultExperiment").get("stepSize") is not None
    variables = root.findall("ModelVariables/ScalarVariable")
    declared = {unit.get("name") for unit in root.findall("UnitDefinitions/Unit")}
    for element in variables:
        assert element.get("description"), element.get("name")
        if element[0].tag == "Real":
            assert element[0].get("unit") in declared, element.get("name")
        if element.get("causality") in ("input", "parameter"):
            assert "start" in element[0].attrib, element.get("name")
    outputs = {str(i) for i, v in enumerate(variables, start=1) if v.get("causality") == "output"}
    structure = root.find("ModelStructure")
    known = {u.get("index"): u.get("dependencies") for u in structure.findall("Outputs/Unknown")}
    assert known == dict.fromkeys(outputs, "")
    assert {u.get("index") for u in structure.findall("InitialUnknowns/Unknown")} == outputs


@pytest.mark.parametrize("name", CONTROLLERS)
def test_outputs_stay_finite_over_two_breaths(shipped: Mapping[str, Path], name: str) -> None:
    fmu = FmuParticipant(shipped[name])
    try:
        fmu.initialize(0.0)
        inputs = [n for n, port in fmu.ports.items() if port.causality is Causality.INPUT]
        fmu.write(dict.fromkeys(inputs, 3.0))
        fmu.begin()
        for i in range(2 * FRAMES):
            fmu.step(i * FRAME, FRAME)
            assert all(math.isfinite(value) for value in fmu.read().values())
    finally:
        fmu.close()


SIGNALS: Mapping[str, Callable[[float], float]] = {
    "volume": lambda angle: 3.5 + 1.4 * math.sin(angle - 1.2),
    "bounding_box_volume": lambda angle: 7.0 + 2.8 * math.sin(angle - 1.2),
    "flow": lambda angle: 60 * math.cos(angle - 1.2),
    "alveolar_pressure": lambda angle: 8 + 6 * math.sin(angle - 1.2),
}
"""What a breathing body gives, in the controllers' units, over an angle of 2π a breath."""


def walk(fmu: FmuParticipant, first: int, last: int, split: int = 1) -> list[dict[str, float]]:
    """Outputs at the end of each frame; within a frame the inputs are nonsense on purpose."""
    inputs = [n for n, port in fmu.ports.items() if port.causality is Causality.INPUT]
    series = []
    for i in range(first * split, last * split):
        frame, inside = divmod(i, split)
        angle = 2 * math.pi * frame / FRAMES
        for name in inputs:
            assert name in SIGNALS, (
                f"nothing is known of an input {name!r}: add to SIGNALS, in "
                "tests/cosim/test_controllers.py, what a breathing body gives there"
            )
        fmu.write({name: 99.0 if inside else SIGNALS[name](angle) for name in inputs})
        fmu.step(i * (FRAME / split), FRAME / split)
        if inside == split - 1:
            series.append(dict(fmu.read()))
    return series


@pytest.fixture
def started(shipped: Mapping[str, Path]) -> Iterator[Callable[[str], FmuParticipant]]:
    """Start a controller that ships, up to the first step, and close it after the test."""
    opened: list[FmuParticipant] = []

    def start_one(name: str) -> FmuParticipant:
        opened.append(start(FmuParticipant(shipped[name])))
        return opened[-1]

    yield start_one
    for fmu in opened:
        fmu.close()


@pytest.mark.parametrize("split", [1, 2, 5])
@pytest.mark.parametrize("name", CONTROLLERS)
def test_outputs_do_not_depend_on_the_communication_step(
    started: Callable[[str], FmuParticipant], name: str, split: int
) -> None:
    whole = walk(started(name), 0, 2 * FRAMES)
    assert walk(started(name), 0, 2 * FRAMES, split) == whole


@pytest.mark.parametrize("name", CONTROLLERS)
def test_restored_state_goes_on_to_the_bit(
    started: Callable[[str], FmuParticipant], name: str
) -> None:
    fmu, other = started(name), started(name)
    walk(fmu, 0, 37)
    saved, written = fmu.get_state(), fmu.serialize()
    onward = walk(fmu, 37, 200)  # over two switches of phase
    fmu.set_state(saved)
    assert walk(fmu, 37, 200) == onward
    other.deserialize(written)
    assert walk(other, 37, 200) == onward


def bounded() -> list[tuple[str, str, float, str]]:
    """Controller, parameter, a value beyond its bound, and what is said of it."""
    cases = []
    for name in CONTROLLERS:
        for parameter, _, lowest, highest, _ in documented(name):
            if lowest is not None:
                cases.append((name, parameter, lowest - 1, f"expected at least {lowest:g}"))
            if highest is not None:
                cases.append((name, parameter, highest + 1, f"expected at most {highest:g}"))
    return cases


def documented(name: str) -> list[tuple[str, str, float | None, float | None, str]]:
    """Parameter, default, bounds and meaning as the table in docs/controller.md has them."""
    _, _, after = DOCS.read_text(encoding="utf-8").partition(f"\n### `{name}`\n")
    section = after.split("\n#")[0]
    rows = re.findall(r"^\| `(\w+)` \| (.*?) \| ?(.*?) \| (.*) \|$", section, re.MULTILINE)
    result = []
    for parameter, default, bounds, meaning in rows:
        low, _, high = bounds.removeprefix("≥ ").partition(" to ")
        result.append(
            (parameter, default, *(float(end) if end else None for end in (low, high)), meaning)
        )
    return result


@pytest.mark.parametrize(("name", "parameter", "value", "message"), bounded())
def test_value_beyond_its_bound_is_refused(
    shipped: Mapping[str, Path], name: str, parameter: str, value: float, message: str
) -> None:
    element = variable(description(shipped[name]), parameter)[0]
    symbol = element.get("unit", "1")
    given_ = int(value) if element.tag == "Integer" else value
    with pytest.raises(FmuError, match=rf"parameter {parameter} = .*: {re.escape(message)}"):
        FmuParticipant(
            shipped[name], parameters={parameter: given_ if symbol == "1" else f"{value} {symbol}"}
        )


@pytest.mark.parametrize("name", CONTROLLERS)
def test_documentation_says_what_a_controller_does(name: str) -> None:
    assert re.search(
        rf"^\| `{name}` \| .+ \| .+ \| .+ \|$", DOCS.read_text("utf-8"), re.MULTILINE
    ), (
        f'docs/controller.md: expected a row "| `{name}` | what it does | takes | source |" in the '
        "table of controllers that ship"
    )


@pytest.mark.parametrize("name", CONTROLLERS)
def test_documentation_has_the_parameters_as_they_are(
    shipped: Mapping[str, Path], name: str
) -> None:
    elements = description(shipped[name]).findall("ModelVariables/*[@causality='parameter']")
    rows = documented(name)
    names = [element.get("name") for element in elements]
    assert [row[0] for row in rows] == names, (
        f'docs/controller.md: expected a section "### `{name}`" whose table '
        f"(| parameter | default | bounds | meaning |) has a row for each of {', '.join(names)}"
    )
    for element, (_, default, *bounds, meaning) in zip(elements, rows, strict=True):
        value = element[0]
        start_ = value.get("start", "")
        if "unit" in value.attrib and value.get("unit") != "1":
            assert quantity(default, value.get("unit", "")) == float(start_)
            assert default.endswith(f" {value.get('unit')}")
        else:
            assert default == start_
        ends = [None if end is None else float(end) for end in map(value.get, ("min", "max"))]
        assert ends == bounds
        assert meaning == element.get("description")


# The controller of the paper.


def start(fmu: FmuParticipant) -> FmuParticipant:
    """Up to the first step; closed if that fails."""
    try:
        fmu.initialize(0.0)
        fmu.begin()
    except FmuError:
        fmu.close()
        raise
    return fmu


def run(
    fmu: Path, volume: Volume, frames: int, *, split: int = 1, **parameters: Any
) -> list[dict[str, float]]:
    """Outputs at the end of each frame; within a frame the volume is nonsense on purpose."""
    participant = start(FmuParticipant(fmu, parameters=parameters))
    try:
        series = []
        for i in range(frames * split):
            frame, inside = divmod(i, split)
            now = 99.0 if inside else volume(frame)
            participant.write({"volume": now, "bounding_box_volume": 2 * now})
            participant.step(i * (FRAME / split), FRAME / split)
            if inside == split - 1:
                series.append(dict(participant.read()))
        return series
    finally:
        participant.close()


def breathing(frame: int) -> float:
    """Litres: wide enough for N to reach both ends of its range and the slope between."""
    return 3.5 + 1.4 * math.sin(2 * math.pi * frame / FRAMES - 1.2)


def sigmoid(pressure: float, centre: float) -> float:
    """f(P) in litres, reading 8: a makes f(0) on inflation the rest volume, 2.5 L."""
    a = 2.5 - 3.5 / (1 + math.exp(20 / 5))
    return a + 3.5 / (1 + math.exp(-(pressure - centre) / 5))


def by_hand(volume: Volume, frames: int, law: str, *, literal: bool) -> list[dict[str, float]]:
    """Reading 8 of docs/model.md, one frame after the other."""
    swing = 40 / FRAMES if literal else 40 / (FRAMES / 2)
    pressure = 0.0
    series = []
    for frame in range(frames):
        inhaling = frame % FRAMES < FRAMES // 2
        pressure = min(max(pressure + (swing if inhaling else -swing), 0.0), 40.0)
        target = sigmoid(pressure, 20 if inhaling else 10)
        short = min(max((target - volume(frame)) / 0.5, 0.0), 1.0)
        n = 100 + (70_000 - 100) * short
        if law == "open":
            n = 70_000.0 if inhaling else 100.0
        if law == "limit" and not inhaling:
            n = 100.0
        series.append(
            {
                "delta_p": swing if inhaling else -swing,
                "n": n,
                "respiratory_pressure": pressure,
                "target_volume": target,
                "phase": float(inhaling),
            }
        )
    return series


@pytest.mark.parametrize("literal", [False, True], ids=["swing 40", "swing 20"])
@pytest.mark.parametrize("law", ["limit", "thermostat", "open"])
def test_paper_controller_follows_its_readings(paper: Path, law: str, literal: bool) -> None:
    series = run(paper, breathing, 2 * FRAMES, law=law, literal_swing=literal)
    expected = by_hand(breathing, 2 * FRAMES, law, literal=literal)
    for mine, theirs in zip(series, expected, strict=True):
        # P is summed up here and multiplied there: 1e-12 of 40 cmH2O, times the slope of N.
        for name, tolerance in {"n": 1e-6, "phase": 0.0}.items():
            assert mine[name] == pytest.approx(theirs[name], rel=0, abs=tolerance)
        for name in ("delta_p", "respiratory_pressure", "target_volume"):
            assert mine[name] == pytest.approx(theirs[name], rel=0, abs=1e-11)


def test_laws_of_the_paper_controller_differ_where_they_should(paper: Path) -> None:
    limit, thermostat, opened = (
        [point["n"] for point in run(paper, breathing, FRAMES, law=law)]
        for law in ("limit", "thermostat", "open")
    )
    half = FRAMES // 2
    assert limit[:half] == thermostat[:half] != opened[:half]
    assert limit[half:] == opened[half:] == [100.0] * half
    assert max(thermostat[half:]) > 100.0


def test_largest_and_smallest_n_are_reached(paper: Path) -> None:
    n = [point["n"] for point in run(paper, breathing, FRAMES)]
    assert (min(n), max(n)) == (100.0, 70_000.0)
    assert any(100.0 < value < 70_000.0 for value in n)


def test_pressure_swings_over_its_whole_range(paper: Path) -> None:
    for literal, top in [(False, 40.0), (True, 20.0)]:
        series = run(paper, breathing, FRAMES, literal_swing=literal)
        pressures = [point["respiratory_pressure"] for point in series]
        assert max(pressures) == pytest.approx(top, rel=1e-15)  # a product of two roundings
        assert pressures[-1] == 0.0


def test_bounding_box_can_be_followed_instead(paper: Path) -> None:
    followed = run(paper, lambda frame: breathing(frame) / 2, FRAMES, follow_bounding_box=True)
    assert followed == run(paper, breathing, FRAMES)  # the box is given as twice the volume


@settings(max_examples=10, deadline=None)
@given(
    rest=st.floats(0.1, 5.0),
    capacity=st.floats(0.1, 5.0),
    centre=st.floats(1.0, 30.0),
    d=st.floats(1.0, 10.0),
)
def test_curve_starts_at_the_rest_volume(
    paper: Path, rest: float, capacity: float, centre: float, d: float
) -> None:
    fmu = FmuParticipant(
        paper,
        parameters={
            "rest_volume": f"{rest!r} L",
            "vital_capacity": f"{capacity!r} L",
            "c_inflation": f"{centre!r} cmH2O",
            "d": f"{d!r} cmH2O",
        },
    )
    try:
        start(fmu)
        # a is a difference of the two: a few roundings of numbers below 10 L.
        assert fmu.read()["target_volume"] == pytest.approx(rest, rel=0, abs=1e-14)
    finally:
        fmu.close()


@pytest.mark.parametrize("split", [2, 4])
def test_sampled_controller_does_not_feel_the_communication_step(paper: Path, split: int) -> None:
    whole = run(paper, breathing, 2 * FRAMES, law="thermostat")
    assert run(paper, breathing, 2 * FRAMES, law="thermostat", split=split) == whole


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"frames": 121}, "frames = 121: expected an even number"),
        ({"law": "relay"}, "law = 'relay': expected 'limit', 'thermostat' or 'open'"),
    ],
)
def test_paper_controller_refuses_what_it_cannot_do(
    paper: Path, parameters: dict[str, Any], message: str
) -> None:
    with pytest.raises(FmuError) as caught:
        start(FmuParticipant(paper, parameters=parameters))
    assert message in str(caught.value)


# Pressure control.


def test_square_wave_has_its_times_and_levels(pressure: Path) -> None:
    # Breaths of 4 s, 1.2 s in: at 276/30 s a switch would come a step late by rounding alone.
    outputs = breathe(
        pressure, Lung(10.0, 0.05), FRAME, 600, constant_n=7.0, inspiratory_time="1.2 s"
    )
    for i, point in enumerate(outputs[1:]):
        inhaling = i % 120 < 36
        assert point["controller"] == {
            "delta_p": 20.0 if inhaling else 5.0,
            "respiratory_pressure": 20.0 if inhaling else 5.0,
            "phase": float(inhaling),
            "n": 7.0,
        }


@pytest.mark.parametrize("resistance", [5.0, 30.0])
def test_tidal_volume_is_that_of_the_closed_form(pressure: Path, resistance: float) -> None:
    compliance, driving, inspiration, breath = 0.05, 12.0, 1.25, 3.0
    parameters = {
        "driving_pressure": f"{driving} cmH2O",
        "inspiratory_time": f"{inspiration} s",
        "rate": f"{60 / breath} 1/min",
    }
    # Twenty breaths: the start has decayed to exp(-40) with the longer time constant of 1.5 s.
    outputs = breathe(pressure, Lung(resistance, compliance), 0.05, 1200, **parameters)
    last = [point["lung"]["volume"] for point in outputs[-61:]]
    expiration, tau = breath - inspiration, resistance * compliance
    closed = (
        compliance
        * driving
        * (1 - math.exp(-inspiration / tau))
        * (1 - math.exp(-expiration / tau))
        / (1 - math.exp(-breath / tau))
    )
    # The lung is solved exactly and switches fall on communication points: roundings remain.
    assert max(last) - min(last) == pytest.approx(closed, rel=1e-9)


def test_inspiration_longer_than_the_breath_is_refused(pressure: Path) -> None:
    with pytest.raises(FmuError, match=r"inspiratory_time = 4\.0 s: expected less than"):
        breathe(pressure, Lung(10.0, 0.05), 0.1, 1, inspiratory_time="4 s")


# From the user's cache.


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setattr("platformdirs.user_cache_path", lambda name: folder / name)
    return folder


def test_second_call_is_answered_from_the_cache(cache: Path) -> None:
    first = controller_fmu("pressure-control")
    written = first.stat().st_mtime_ns
    assert controller_fmu("pressure-control") == first
    assert first.stat().st_mtime_ns == written
    assert list(first.parent.iterdir()) == [first]
    assert first.is_relative_to(cache)


def test_cached_fmu_is_the_built_one(cache: Path, pressure: Path) -> None:
    assert controller_fmu("pressure-control").read_bytes() == pressure.read_bytes()


def test_without_a_cache_folder_a_temporary_one_serves(
    cache: Path, temporary: Path, pressure: Path
) -> None:
    cache.write_text("a file is in the way")
    fmu = controller_fmu("pressure-control")
    assert fmu.is_relative_to(temporary)
    assert fmu.read_bytes() == pressure.read_bytes()


def test_unknown_controller_is_refused_with_the_nearest() -> None:
    with pytest.raises(ControllerError, match="did you mean 'paper'"):
        controller_fmu("papr")


def test_integer_outputs_are_ports_too(paper: Path) -> None:
    assert variable(description(paper), "phase")[0].tag == "Integer"
    assert run(paper, breathing, 1)[0]["phase"] == 1.0
