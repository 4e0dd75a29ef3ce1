from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim import Connection, SignalError, WiringError, cosimulate
from tests.cosim.helpers import Relaxation, Sink, Source

WIRES = [Connection("b.x", "a.u"), Connection("a.x", "b.u")]


def pair() -> list[Relaxation]:
    return [Relaxation("a", -1.0, 1.0, 1.0), Relaxation("b", -2.0, 1.0, 3.0)]


@settings(max_examples=20, deadline=None)
@given(st.sampled_from([0.1, 1 / 30, 1e-3]) | st.floats(1e-4, 10), st.floats(-100, 100))
def test_times_are_start_plus_a_multiple_to_the_bit(step: float, start: float) -> None:
    participants = pair()
    points = list(cosimulate(participants, WIRES, step=step, steps=40, start=start))
    times = [start + i * step for i in range(41)]
    assert [point.time for point in points] == times
    assert [point.index for point in points] == list(range(41))
    for participant in participants:
        assert [time for call, time in participant.calls if call == "step"] == times[:-1]


@pytest.mark.parametrize("step", [0.1, 1 / 30])
def test_rounding_does_not_add_up(step: float) -> None:
    points = list(cosimulate(pair(), WIRES, step=step, steps=300))
    added = list(itertools.accumulate([step] * 300, initial=0.0))
    assert points[300].time == 300 * step != added[300]


def test_calls_come_in_the_order_of_the_protocol() -> None:
    participants = pair()
    list(cosimulate(participants, WIRES, step=0.5, steps=2))
    calls = [call for call, _ in participants[0].calls]
    assert calls == ["initialize", "write", "begin", "write", "step", "write", "step"]


def test_inputs_are_there_before_time_moves() -> None:
    participants = pair()
    next(cosimulate(participants, WIRES, step=0.5, steps=2))
    assert dict(participants[0].calls)["begin"] == 3.0  # what b starts from


def test_first_point_is_the_state_before_any_step() -> None:
    participants = pair()
    first = next(cosimulate(participants, WIRES, step=0.5, steps=1, start=2.0))
    assert (first.index, first.time) == (0, 2.0)
    assert first.outputs == {"a": {"x": 1.0}, "b": {"x": 3.0}}


def test_points_keep_their_outputs_as_time_goes_on() -> None:
    points = list(cosimulate(pair(), WIRES, step=0.5, steps=2))
    assert len({point.outputs["a"]["x"] for point in points}) == 3


def test_faulty_wiring_is_found_before_anything_starts() -> None:
    participants = pair()
    with pytest.raises(WiringError, match=r"b\.u is not connected"):
        next(cosimulate(participants, WIRES[:1], step=0.5, steps=1))
    assert participants[0].calls == []


def test_nan_on_a_connection_stops_the_loop_at_once() -> None:
    source = Source(1.0)
    loop = cosimulate([source, Sink()], [Connection("source.y", "sink.u")], step=1.0, steps=9)
    next(loop)
    source.value = float("nan")
    with pytest.raises(SignalError, match=r"source\.y → sink\.u"):
        next(loop)
