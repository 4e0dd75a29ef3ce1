from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from cosim import (
    Causality,
    Connection,
    FmuEndedError,
    FmuError,
    FmuParticipant,
    Port,
    SignalError,
    cosimulate,
)
from tests.cosim.helpers import Relaxation, Source, run_python

FRAME = 1 / 30
Start = Callable[..., FmuParticipant]


@pytest.fixture
def start() -> Iterator[Start]:
    """Start an FMU, up to the first step, and close it after the test."""
    opened = []

    def started(path: Path, **parameters: Any) -> FmuParticipant:
        fmu = FmuParticipant(path, parameters=parameters)
        opened.append(fmu)
        fmu.initialize(0.0)
        fmu.begin()
        return fmu

    yield started
    for fmu in opened:
        fmu.close()


def test_ports_carry_the_units_of_the_fmu(paper: Path) -> None:
    fmu = FmuParticipant(paper)
    fmu.close()
    symbols = {name: port.unit.symbol for name, port in fmu.ports.items() if port.unit}
    inputs = {name for name, port in fmu.ports.items() if port.causality is Causality.INPUT}
    assert inputs == {"volume", "bounding_box_volume"}
    assert symbols["volume"] == "L"
    assert symbols["delta_p"] == "cmH2O"
    assert symbols["n"] == "1"
    assert fmu.ports["phase"].unit is None
    assert fmu.ports["volume"].description == "enclosed volume of the lung"


def test_hash_is_that_of_the_file(paper: Path) -> None:
    fmu = FmuParticipant(paper)
    fmu.close()
    assert fmu.sha256 == hashlib.sha256(paper.read_bytes()).hexdigest()


def test_fmi2_computes_what_its_source_says(faulty: Path, start: Start) -> None:
    fmu = start(faulty)
    fmu.write({"u": 21.0})
    fmu.step(0.0, 1.0)
    assert fmu.read() == {"y": 42.0}


def test_inputs_that_are_not_written_stay(paper: Path, start: Start) -> None:
    fmu = start(paper, follow_bounding_box=True, rest_volume="2.5 L")
    fmu.write({"volume": 9.0, "bounding_box_volume": 2.4})
    fmu.write({"volume": 1.0})
    fmu.step(0.0, FRAME)
    shortfall = fmu.read()["target_volume"] - 2.4
    expected = 100.0 + (70_000.0 - 100.0) * shortfall / 0.5
    assert 0.0 < shortfall < 0.5  # between the limits of n
    assert fmu.read()["n"] == expected


def test_input_that_does_not_fit_is_named(faulty: Path, start: Start) -> None:
    with pytest.raises(FmuError, match=r"could not take \{'u': 'much'\}: .*number"):
        start(faulty).write({"u": "much"})  # type: ignore[dict-item]


def test_both_shipped_controllers_run_in_one_loop(paper: Path, pressure: Path) -> None:
    first, second = FmuParticipant(paper, "first"), FmuParticipant(pressure, "second")
    lung = Relaxation("lung", -1.0, 0.1, 2.5, "L")
    lung.ports = {**lung.ports, "u": Port("u", None, Causality.INPUT)}
    wires = [
        Connection("first.phase", "lung.u"),
        Connection("lung.x", "first.volume"),
        Connection("lung.x", "first.bounding_box_volume"),
    ]
    try:
        points = list(cosimulate([first, second, lung], wires, step=FRAME, steps=3))
    finally:
        first.close()
        second.close()
    assert points[3].outputs["first"]["respiratory_pressure"] == pytest.approx(2.0, rel=1e-15)
    assert points[3].outputs["second"]["delta_p"] == 20.0


def test_parameter_with_a_unit_is_converted(pressure: Path, start: Start) -> None:
    fmu = start(pressure, peep="490.3325 Pa", driving_pressure="0.980665 kPa", rate="0.25 s-1")
    fmu.step(0.0, 0.1)
    assert fmu.read()["delta_p"] == pytest.approx(15.0, rel=1e-15)  # a sum of two exact ones


def test_parameters_of_other_types_reach_the_fmu(paper: Path, start: Start) -> None:
    fmu = start(paper, frames=60, literal_swing=True, law="open")
    fmu.step(0.0, 1 / 15)
    assert fmu.read()["delta_p"] == 40.0 / 60
    assert fmu.read()["n"] == 70_000.0


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ({"frams": 120}, "no parameter 'frams'; did you mean 'frames'"),
        ({"volume": "1 L"}, "no parameter 'volume'"),  # an input
        ({"rest_volume": 2.5}, "rest_volume = 2.5 has no unit; write it like '2.5 L'"),
        ({"rest_volume": "2.5"}, "rest_volume: '2.5' cannot be converted to 'L'"),
        ({"rest_volume": "2.5 cmH2O"}, "rest_volume: '2.5 cmH2O' cannot be converted to 'L'"),
        ({"rest_volume": "-1 mL"}, "rest_volume = -0.001: expected at least 0"),
        ({"n_inflation": -1.0}, "n_inflation = -1.0: expected at least 0"),
        ({"n_inflation": math.nan}, "n_inflation = nan: expected Real"),
        ({"n_inflation": math.inf}, "n_inflation = inf: expected Real"),
        ({"frames": 0}, "frames = 0: expected at least 2"),
        ({"frames": 120.5}, "frames = 120.5: expected Integer"),
        ({"frames": "many"}, "frames = 'many': expected Integer"),
        ({"literal_swing": "false"}, "literal_swing = 'false': expected Boolean"),
    ],
)
def test_parameter_that_does_not_fit_is_refused(
    paper: Path, temporary: Path, parameters: dict[str, Any], text: str
) -> None:
    with pytest.raises(FmuError) as caught:
        FmuParticipant(paper, parameters=parameters)
    assert text in str(caught.value)
    assert list(temporary.iterdir()) == []


def test_exception_while_stepping_reaches_the_message(faulty: Path, start: Start) -> None:
    fmu = start(faulty, fault="step")
    with pytest.raises(FmuError, match=r"RuntimeError\('the pump has stopped'\)") as caught:
        fmu.step(0.25, 1.0)
    assert "step from t = 0.25 s" in str(caught.value)
    assert str(faulty) in str(caught.value)


def test_exception_in_initialization_reaches_the_message(faulty: Path, start: Start) -> None:
    with pytest.raises(FmuError, match="the valve is shut") as caught:
        start(faulty, fault="initialization")
    assert "leave initialization" in str(caught.value)


def test_refused_step_is_an_error(faulty: Path, start: Start) -> None:
    # pythonfmu answers a refusal with "discard", and "terminated" to the question that follows.
    fmu = start(faulty, fault="refusal")
    with pytest.raises(FmuEndedError, match=r"asked to end the simulation at t = 0 s"):
        fmu.step(0.0, 1.0)


def test_outputs_after_a_failure_are_those_before_it(faulty: Path, start: Start) -> None:
    fmu = start(faulty, fault="step")
    with pytest.raises(FmuError):
        fmu.step(0.0, 1.0)
    assert fmu.read() == {"y": 0.0}


FAIL_AND_COLLECT = """
import gc, sys
from cosim import FmuError, FmuParticipant

for _ in range(6):
    fmu = FmuParticipant(sys.argv[1], parameters={"fault": sys.argv[2]})
    try:
        fmu.initialize(0.0)
        fmu.begin()
        fmu.step(0.0, 1.0)
    except FmuError:
        pass
    fmu.close()
    gc.collect()
print("alive")
"""


@pytest.mark.parametrize("fault", ["initialization", "step", "termination"])
def test_failed_fmu_leaves_memory_sound(faulty: Path, fault: str) -> None:
    # Freeing a pythonfmu FMU after an exception drops its objects twice: a crash, sooner or later.
    done = run_python(FAIL_AND_COLLECT, faulty, fault)
    assert (done.returncode, done.stdout.split()) == (0, ["alive"]), done.stderr[-500:]


def test_log_of_the_fmu_is_kept(faulty: Path, start: Start) -> None:
    assert "[ok] ready to start" in start(faulty).log.messages


def test_failure_to_terminate_is_kept_as_a_message(faulty: Path, start: Start) -> None:
    fmu = start(faulty, fault="termination")
    fmu.close()
    assert any("the switch is stuck" in message for message in fmu.log.messages)


def test_nan_output_is_readable_and_stops_at_the_connection(faulty: Path) -> None:
    fmu = FmuParticipant(faulty, "pump", {"fault": "nan"})
    lung = Relaxation("lung", -1.0, 1.0, 1.0)
    wires = [Connection("pump.y", "lung.u"), Connection("lung.x", "pump.u")]
    with pytest.raises(SignalError, match=r"pump\.y → lung\.u carries nan"):
        list(cosimulate([fmu, lung], wires, step=1.0, steps=2))
    assert math.isnan(fmu.read()["y"])
    fmu.close()


def test_second_run_needs_a_new_participant(faulty: Path, start: Start) -> None:
    fmu = start(faulty)
    with pytest.raises(FmuError, match="already running"):
        fmu.initialize(0.0)


@pytest.mark.parametrize("fault", ["none", "initialization", "step", "termination"])
def test_folder_is_there_while_it_runs_and_gone_after(
    faulty: Path, temporary: Path, fault: str
) -> None:
    one, other = (FmuParticipant(faulty, parameters={"fault": fault}) for _ in range(2))
    assert len(list(temporary.glob("softbody-fmu-*"))) == 2
    try:
        one.initialize(0.0)
        one.begin()
        one.step(0.0, 1.0)
    except FmuError:
        assert fault in ("initialization", "step")
    one.close()
    one.close()  # may be called twice
    assert len(list(temporary.iterdir())) == 1
    other.close()
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize("serialized", [False, True], ids=["kept", "as bytes in another instance"])
@pytest.mark.parametrize("name", ["paper", "pressure-control"])
def test_restored_state_goes_on_to_the_bit(
    shipped: dict[str, Path], start: Start, name: str, serialized: bool
) -> None:
    def steps(fmu: FmuParticipant, first: int, last: int) -> list[dict[str, float]]:
        values = []
        for i in range(first, last):
            if name == "paper":
                fmu.write({"volume": 2.5 + math.sin(0.1 * i), "bounding_box_volume": 5.0})
            fmu.step(i * FRAME, FRAME)
            values.append(dict(fmu.read()))
        return values

    fmu = start(shipped[name])
    steps(fmu, 0, 37)
    state = fmu._calls.fmu.getFMUState()
    data = fmu._calls.fmu.serializeFMUState(state)
    onward = steps(fmu, 37, 150)  # over the switch to the next breath
    if serialized:
        fmu = start(shipped[name])
        state = fmu._calls.fmu.deserializeFMUState(data)
    fmu._calls.fmu.setFMUState(state)
    assert steps(fmu, 37, 150) == onward


def test_fmi3_integrates_in_its_own_units(reservoir: Path) -> None:
    fmu = FmuParticipant(reservoir, "tank", {"capacity": "0.1 m3"})
    participants = [Source(2e-3, "m3/s"), fmu]
    wires = [Connection("source.y", "tank.flow")]
    try:
        points = list(cosimulate(participants, wires, step=0.25, steps=8))
    finally:
        fmu.close()
    # 2 L/s in steps of a quarter of a second: all numbers are exact in binary.
    assert [point.outputs["tank"]["volume"] for point in points] == [0.5 * i for i in range(9)]
    assert points[8].outputs["tank"]["fills"] == 8.0
    assert "time" not in fmu.ports  # the independent variable is no port


def test_fmi3_may_end_the_simulation(reservoir: Path, start: Start) -> None:
    fmu = start(reservoir, capacity="1 mL")
    fmu.write({"flow": 2.0})
    with pytest.raises(FmuError, match=r"asked to end the simulation at t = 1\.5 s"):
        fmu.step(1.0, 0.5)


def test_fmi3_exception_reaches_the_message_and_the_folder_goes(
    reservoir: Path, temporary: Path
) -> None:
    fmu = FmuParticipant(reservoir, parameters={"capacity": "1 mL", "strict": True})
    fmu.initialize(0.0)
    fmu.begin()
    fmu.write({"flow": 2.0})
    with pytest.raises(FmuError, match=r"OverflowError\('the tank runs over'\)"):
        fmu.step(0.0, 1.0)
    fmu.close()
    assert list(temporary.iterdir()) == []


def test_fmi3_parameter_without_its_unit_is_refused(reservoir: Path) -> None:
    with pytest.raises(FmuError, match="capacity = 3 has no unit; write it like '3 L'"):
        FmuParticipant(reservoir, parameters={"capacity": 3})
