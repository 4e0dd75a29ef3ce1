"""Compiled FMUs of every version that behave: ports of every type, steps of every kind."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim import (
    Causality,
    Connection,
    FmuEndedError,
    FmuError,
    FmuParticipant,
    FmuStepError,
    cosimulate,
)
from tests.cosim.foreign import STATES, VARIABLE_STEP
from tests.cosim.helpers import Source

Foreign = Callable[..., Path]
Start = Callable[..., FmuParticipant]

VERSIONS = pytest.mark.parametrize("version", [1, 2, 3])
FIXED = 'canHandleVariableCommunicationStepSize="false"'


@pytest.fixture
def start() -> Iterator[Start]:
    """Start an FMU, up to the first step, and close it after the test."""
    opened = []

    def started(path: Path, inputs: dict[str, float] | None = None, **options: Any) -> Any:
        fmu = FmuParticipant(path, **options)
        opened.append(fmu)
        fmu.initialize(0.0)
        fmu.write(inputs or {})
        fmu.begin()
        return fmu

    yield started
    for fmu in opened:
        fmu.close()


@VERSIONS
def test_every_version_computes_what_its_source_says(
    foreign: Foreign, start: Start, version: int
) -> None:
    fmu = start(foreign(version), {"volume": 2.0}, parameters={"gain": 4.0, "target": "2500 mL"})
    units = {name: port.unit.symbol for name, port in fmu.ports.items()}
    assert units == {"volume": "L", "delta_p": "cmH2O", "clock": "s"}
    fmu.step(0.0, 0.25)
    assert fmu.read() == {"delta_p": 2.0, "clock": 0.25}


@VERSIONS
def test_every_version_runs_in_a_loop(foreign: Foreign, version: int) -> None:
    fmu = FmuParticipant(foreign(version))
    wires = [Connection("source.y", "controller.volume")]
    try:
        loop = cosimulate([Source(2e-3, "m3"), fmu], wires, step=0.125, steps=2, start=1.0)
        points = [point.outputs["controller"] for point in loop]
    finally:
        fmu.close()
    # FMI 1.0 has no mode in which outputs are read before the first step; then it is 0 as declared.
    assert [point["clock"] for point in points] == [1.0, 1.125, 1.25]
    assert [point["delta_p"] for point in points] == [0.0, 5.0, 5.0]


@VERSIONS
def test_integers_enumerations_and_booleans_are_ports(
    foreign: Foreign, start: Start, version: int
) -> None:
    fmu = start(foreign(version, ports="typed"))
    fmu.write({"volume": 0.0, "stride": 3.0, "wanted": 2.0, "enabled": 0.0})
    fmu.step(0.0, 0.25)
    assert {name: fmu.read()[name] for name in ("count", "level", "on")} == {
        "count": 3.0,
        "level": 2.0,
        "on": 0.0,
    }
    fmu.write({"volume": 0.0, "stride": -1.2, "wanted": 0.99, "enabled": 1.0})  # to the nearest
    fmu.step(0.25, 0.25)
    assert (fmu.read()["count"], fmu.read()["level"], fmu.read()["on"]) == (2.0, 1.0, 1.0)


def test_a_value_that_an_integer_does_not_hold_is_refused(foreign: Foreign, start: Start) -> None:
    fmu = start(foreign(3, ports="typed"))
    with pytest.raises(FmuError, match=r"take \{'stride': 128.0\}: the value is out of the range"):
        fmu.write({"stride": 128.0})  # an Int8
    with pytest.raises(FmuError, match="NaN"):
        fmu.write({"stride": float("nan")})


def test_elements_of_an_array_are_ports(foreign: Foreign, start: Start) -> None:
    fmu = start(foreign(3, ports="arrays"))
    given = {name for name, port in fmu.ports.items() if port.causality is Causality.OUTPUT}
    assert given == {"delta_p", "clock", "out[0]", "out[1]"}
    fmu.write({"volume": 0.0, "in[1]": 5.0, "in[0]": 3.0})
    fmu.step(0.0, 0.25)
    assert (fmu.read()["out[0]"], fmu.read()["out[1]"]) == (3.0, 10.0)


def test_elements_of_an_array_are_parameters(foreign: Foreign, start: Start) -> None:
    fmu = start(foreign(3, ports="arrays"), parameters={"gains[1]": -1.0})
    fmu.write({"in[0]": 3.0, "in[1]": 5.0})
    fmu.step(0.0, 0.25)
    assert (fmu.read()["out[0]"], fmu.read()["out[1]"]) == (3.0, -5.0)


def test_a_structural_parameter_decides_the_shape(foreign: Foreign, start: Start) -> None:
    fmu = start(foreign(3, ports="arrays"), parameters={"size": 3, "gain": 1.0})
    assert "out[2]" in fmu.ports
    fmu.write({"in[0]": 1.0, "in[1]": 1.0, "in[2]": 1.0})
    fmu.step(0.0, 0.25)
    assert [fmu.read()[f"out[{i}]"] for i in range(3)] == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"gains[2]": 1.0}, r"no parameter 'gains\[2\]'; did you mean 'gains\[1\]'"),
        ({"size": 3, "gains[2]": 1.0}, "gains has 3 elements and 2 start values"),
        ({"gains[0]": "much"}, r"parameter gains\[0\] = 'much': expected Float64"),
    ],
)
def test_an_array_parameter_that_does_not_fit_is_refused(
    foreign: Foreign, parameters: dict[str, Any], message: str
) -> None:
    with pytest.raises(FmuError, match=message):
        FmuParticipant(foreign(3, ports="arrays"), parameters=parameters)


def test_an_array_is_written_as_a_whole(foreign: Foreign, start: Start) -> None:
    with pytest.raises(FmuError, match=r"takes an array as a whole; in\[1\] is missing"):
        start(foreign(3, ports="arrays")).write({"in[0]": 1.0})


def test_a_fixed_step_is_taken_several_times(foreign: Foreign, start: Start) -> None:
    path = foreign(2, "STEP_LENGTH=0.05", ports="typed", flags=FIXED, experiment='stepSize="0.05"')
    fmu = start(path)
    fmu.check_step(0.15)
    fmu.step(0.0, 0.15)
    assert fmu.read()["count"] == 3.0
    assert fmu.read()["clock"] == pytest.approx(0.15, rel=1e-15)  # a sum of two roundings


def test_the_internal_step_of_fmi3_counts_before_the_default_one(foreign: Foreign) -> None:
    flags = 'fixedInternalStepSize="0.02"'
    fmu = FmuParticipant(foreign(3, flags=flags, experiment='stepSize="1"'))
    fmu.close()
    fmu.check_step(0.06)
    with pytest.raises(FmuStepError, match=r"steps by 0\.02 s .* is 0\.05 s. Make it 0\.02 s or"):
        fmu.check_step(0.05)


@pytest.mark.parametrize("version", [1, 2])
def test_a_fixed_step_that_is_not_told_is_the_first_one(
    foreign: Foreign, start: Start, version: int
) -> None:
    fmu = start(foreign(version, ports="typed", flags=FIXED))
    fmu.step(0.0, 0.25)
    fmu.step(0.25, 0.5)  # twice the first one
    assert fmu.read()["count"] == 3.0
    with pytest.raises(FmuStepError, match=r"steps by 0\.25 s and cannot vary its step"):
        fmu.step(0.75, 0.1)


@VERSIONS
def test_a_step_may_vary_where_the_fmu_says_so(
    foreign: Foreign, start: Start, version: int
) -> None:
    fmu = start(foreign(version, flags=VARIABLE_STEP))
    fmu.step(0.0, 0.25)
    fmu.step(0.25, 0.1)
    assert fmu.read()["clock"] == 0.35


def test_an_early_return_is_followed_by_the_rest(foreign: Foreign, start: Start) -> None:
    fmu = start(foreign(3, "EARLY=0.5", ports="typed"))
    fmu.step(0.0, 1 / 64)
    # 1/128, 1/256, 1/512, 1/1024 s, and the rest of 1/1024 s, which is short enough to be done.
    assert (fmu.read()["count"], fmu.read()["clock"]) == (5.0, 1 / 64)


@pytest.mark.parametrize("version", [2, 3])
def test_a_request_to_end_has_a_name_of_its_own(
    foreign: Foreign, start: Start, version: int
) -> None:
    fmu = start(foreign(version, "TERMINATE"))
    fmu.step(0.0, 0.1)
    with pytest.raises(FmuEndedError, match=r"asked to end the simulation at t = 0\.2 s"):
        fmu.step(0.1, 0.1)
    assert fmu.read()["clock"] == 0.1  # the state before


@VERSIONS
def test_a_refused_step_has_a_name_of_its_own(foreign: Foreign, start: Start, version: int) -> None:
    fmu = start(foreign(version, "STATUS=2"))
    with pytest.raises(FmuStepError, match=r"refused the step .* by 0\.5 s; it came to t = 0\.25"):
        fmu.step(0.25, 0.5)


@VERSIONS
def test_a_warning_is_kept_and_the_run_goes_on(
    foreign: Foreign, start: Start, version: int
) -> None:
    fmu = start(foreign(version, "WARN"))
    for i in range(30):
        fmu.step(0.25 * i, 0.25)
    assert fmu.log.warnings[0].startswith("the filter is due")
    assert len(fmu.log.warnings) == (1 if version == 3 else 20)  # each text once, and not too many
    assert fmu.log.count == 30


def test_two_fmus_log_to_their_own(foreign: Foreign, start: Start) -> None:
    first, second = start(foreign(2, "WARN")), start(foreign(2, "STATUS=3"))
    first.step(0.0, 0.25)
    with pytest.raises(FmuError, match="the pump has stopped") as caught:
        second.step(0.25, 0.25)
    assert "filter" not in str(caught.value)
    assert [*first.log.messages] == ["[warning] the filter is due at t = 0.25 s"]


@pytest.mark.parametrize("version", [2, 3])
def test_a_saved_state_goes_on_to_the_bit(foreign: Foreign, start: Start, version: int) -> None:
    ports = "typed arrays" if version == 3 else "typed"
    fmu = start(foreign(version, ports=ports, flags=STATES), {"volume": 0.1, "stride": 3.0})
    assert fmu.can_get_and_set_state
    assert fmu.can_serialize_state

    def onward() -> list[dict[str, float]]:
        series = [dict(fmu.read())]
        for i in range(3, 9):
            fmu.step(i * 0.1, 0.1)
            series.append(dict(fmu.read()))
            fmu.write({"volume": 0.1 * i})
        return series

    for i in range(3):
        fmu.step(i * 0.1, 0.1)
    saved, dumped = fmu.get_state(), fmu.serialize()
    first = onward()
    fmu.set_state(saved)
    assert onward() == first
    fmu.deserialize(dumped)
    assert onward() == first
    fmu.set_state(saved)  # as often as need be
    assert onward() == first
    fmu.free_state(saved)
    twin = fmu = start(foreign(version, ports=ports, flags=STATES))
    twin.deserialize(dumped)
    assert onward() == first


@settings(max_examples=20, deadline=None)
@given(
    volumes=st.lists(st.floats(-1e300, 1e300), min_size=1, max_size=12),
    cut=st.integers(0, 11),
    step=st.floats(1e-6, 1e3),
)
def test_going_back_to_any_point_repeats_what_followed(
    foreign: Foreign, volumes: list[float], cut: int, step: float
) -> None:
    fmu = FmuParticipant(foreign(2, ports="typed", flags=STATES))

    def onward(first: int) -> list[dict[str, float]]:
        series = []
        for i, volume in enumerate(volumes[first:], first):
            fmu.write({"volume": volume})
            fmu.step(i * step, step)
            series.append(dict(fmu.read()))
        return series

    try:
        fmu.initialize(0.0)
        fmu.begin()
        for i, volume in enumerate(volumes[:cut]):
            fmu.write({"volume": volume})
            fmu.step(i * step, step)
        saved = fmu.get_state()
        first = onward(cut)
        fmu.set_state(saved)
        assert onward(cut) == first
        fmu.free_state(saved)
    finally:
        fmu.close()


@VERSIONS
def test_an_fmu_without_rollback_says_so(foreign: Foreign, start: Start, version: int) -> None:
    fmu = start(foreign(version))
    assert not fmu.can_get_and_set_state
    assert not fmu.can_serialize_state
    with pytest.raises(FmuError, match=r"cannot save its state .*couple it without rollback"):
        fmu.get_state()
    with pytest.raises(FmuError, match=r"cannot write its state down .*no checkpoints"):
        fmu.serialize()


def test_a_promise_of_rollback_that_is_not_kept_is_an_error(foreign: Foreign, start: Start) -> None:
    fmu = start(foreign(2, "NO_STATE", flags=STATES))
    with pytest.raises(FmuError, match=r"save its state: fmi2GetFMUstate answered with status 3"):
        fmu.get_state()


def test_a_dump_of_something_else_is_an_error(foreign: Foreign, start: Start) -> None:
    fmu = start(foreign(2, ports="typed", flags=STATES))
    with pytest.raises(FmuError, match="read a state"):
        fmu.deserialize(fmu.serialize() + b"more")
    with pytest.raises(FmuError, match="read a state"):
        fmu.deserialize(b"nothing")
