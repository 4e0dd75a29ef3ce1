from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim import Connection, SignalError, WiringError
from cosim.connection import Wiring
from tests.cosim.helpers import Sink, Source

WIRE = Connection("source.y", "sink.u")


@pytest.mark.parametrize(
    ("given_in", "taken_in", "value", "expected"),
    [
        ("cmH2O", "Pa", 2.0, 196.133),
        ("L/s", "m3/s", 3.0, 3e-3),
        ("degC", "K", 20.0, 293.15),
        ("K", "degC", 293.15, 20.0),
        ("1", "1", 7.0, 7.0),
        (None, None, 7.0, 7.0),
    ],
)
def test_value_arrives_in_the_unit_of_the_input(
    given_in: str | None, taken_in: str | None, value: float, expected: float
) -> None:
    source, sink = Source(value, given_in), Sink(taken_in)
    received = Wiring([source, sink], [WIRE]).inputs_of(sink)
    assert received == {"u": pytest.approx(expected, rel=1e-14)}  # a product and a sum


@settings(max_examples=30, deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_value_between_equal_units_is_untouched(value: float) -> None:
    source, sink = Source(value, "cmH2O"), Sink("cmH2O")
    assert Wiring([source, sink], [WIRE]).inputs_of(sink) == {"u": value}


def test_incompatible_units_are_refused_with_both_named() -> None:
    with pytest.raises(WiringError, match=r"source\.y → sink\.u: 'L' cannot be .* 'cmH2O'"):
        Wiring([Source(1.0, "L"), Sink("cmH2O")], [WIRE])


@pytest.mark.parametrize(
    ("source", "sink", "silent"),
    [(None, "L", r"source\.y declares no unit"), ("L", None, r"sink\.u declares no unit")],
)
def test_unit_on_one_side_only_is_refused(
    source: str | None, sink: str | None, silent: str
) -> None:
    with pytest.raises(WiringError, match=silent):
        Wiring([Source(1.0, source), Sink(sink)], [WIRE])


@pytest.mark.parametrize(
    ("source", "target", "message"),
    [
        ("sorce.y", "sink.u", "no participant 'sorce'; did you mean 'source'"),
        ("source.y", "sinc.u", "no participant 'sinc'; did you mean 'sink'"),
        ("source.yy", "sink.u", "source has no output 'yy'; did you mean 'y'"),
        ("source.y", "sink.uu", "sink has no input 'uu'; did you mean 'u'"),
        ("sink.u", "sink.u", "sink has no output 'u'; known: none"),  # an input gives nothing
        ("source", "sink.u", "source has no output ''; known: y"),
    ],
)
def test_unknown_end_is_refused_with_what_there_is(source: str, target: str, message: str) -> None:
    with pytest.raises(WiringError) as caught:
        Wiring([Source(1.0), Sink()], [Connection(source, target)])
    assert message in str(caught.value)


def test_input_takes_one_connection() -> None:
    participants = [Source(1.0), Source(2.0, name="second"), Sink()]
    with pytest.raises(WiringError, match=r"connected twice: source\.y .* and second\.y"):
        Wiring(participants, [WIRE, Connection("second.y", "sink.u")])


def test_output_feeds_many_inputs() -> None:
    sinks = [Sink(name="a"), Sink(name="b")]
    wires = [Connection("source.y", "a.u"), Connection("source.y", "b.u")]
    wiring = Wiring([Source(4.0), *sinks], wires)
    assert [wiring.inputs_of(sink) for sink in sinks] == [{"u": 4.0}] * 2


def test_open_input_is_refused_by_name() -> None:
    with pytest.raises(WiringError, match=r"sink\.u is not connected"):
        Wiring([Source(1.0), Sink()], [])


def test_optional_input_may_stay_open() -> None:
    sink = Sink(optional=True)
    assert Wiring([sink], []).inputs_of(sink) == {}


def test_names_of_participants_differ() -> None:
    with pytest.raises(WiringError, match="different names"):
        Wiring([Source(1.0), Source(2.0)], [])


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_value_that_is_not_finite_names_its_connection(value: float) -> None:
    source, sink = Source(value), Sink()
    wiring = Wiring([source, sink], [WIRE])
    with pytest.raises(SignalError, match=rf"source\.y → sink\.u carries {value}"):
        wiring.inputs_of(sink)
