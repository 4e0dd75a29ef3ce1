from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios import ScenarioError
from scenarios.scene.decode import decode
from scenarios.scene.schema import Body, Coupling, Mesh, Run
from scenarios.scene.tables import choose, refuse_unknown, table
from softbody_core import AirwayResistance, MassSpring, PinnedPoints, Weights


@given(grams=st.integers(min_value=1, max_value=10**9))
@settings(deadline=None, max_examples=30)
def test_a_quantity_arrives_in_si_units(grams: int) -> None:
    # One division by 1000 in decimals, and one rounding to binary.
    assert decode(Body, {"mass": f"{grams} g"}, "body").mass == grams / 1000


@pytest.mark.parametrize(
    ("text", "value"),
    [("10 cmH2O.s/L", 980665.0), ("980665 Pa.s/m^3", 980665.0), ("10 cmH2O*s/L", 980665.0)],
)
def test_compound_units_can_be_written_in_several_ways(text: str, value: float) -> None:
    law = decode(AirwayResistance, {"resistance": text}, "airway")
    # Four products of decimals that are exact, and one rounding.
    assert law.resistance == pytest.approx(value, rel=1e-15)


def test_a_fraction_of_a_second_is_understood() -> None:
    assert decode(Coupling, {"step": "1/30 s"}, "coupling").step == pytest.approx(1 / 30, rel=1e-15)


def test_what_is_not_given_has_its_default() -> None:
    assert decode(Run, {"period": "4 s"}, "run") == Run(period=4.0, cycles=5)
    assert decode(Weights, {}, "forces") == Weights()


def test_a_list_becomes_a_tuple() -> None:
    assert decode(PinnedPoints, {"indices": [3, 1]}, "pins").indices == (3, 1)


@pytest.mark.parametrize(
    ("kind", "data", "fragments"),
    [
        (Weights, {"alhpa": 1.0}, ["here.alhpa is unknown", "did you mean 'alpha'?", "gamma"]),
        (Body, {}, ["here.mass is missing", '"1 kg"']),
        (PinnedPoints, {}, ["here.indices is missing"]),
        (Body, {"mass": 1.0}, ["here.mass = 1.0 has no unit", '"1.0 kg"']),
        (Body, {"mass": None}, ["here.mass"]),
        (Body, {"mass": "1"}, ["here.mass", "'kg'"]),
        (Body, {"mass": "1 L"}, ["here.mass", "'1 L' cannot be converted to 'kg'"]),
        (Body, {"mass": "heavy"}, ["here.mass", "'heavy' is no quantity", "'1 kg'"]),
        (Body, {"mass": "0 kg"}, ["here.mass = 0 kg", "more than 0"]),
        (Body, {"mass": "nan kg"}, ["here.mass"]),
        (Body, {"mass": "inf kg"}, ["here.mass"]),
        (Weights, {"alpha": 0.0}, ["here.alpha = 0", "more than 0"]),
        (Weights, {"gamma": -1.0}, ["here.gamma = -1", "at least 0"]),
        (Weights, {"beta": float("nan")}, ["here.beta", "finite"]),
        (Weights, {"alpha": "1"}, ["here.alpha = '1'", "a number"]),
        (Weights, {"alpha": True}, ["here.alpha", "a number"]),
        (MassSpring, {"stiffness": "375 N", "damping": "0 N.s/m"}, ["here.stiffness", "'N/m'"]),
        (Mesh, {"ball": 162.5}, ["here.ball = 162.5", "a whole number"]),
        (Mesh, {"weld": "yes"}, ["here.weld = 'yes'", "true or false"]),
        (Run, {"period": "4 s", "cycles": 0}, ["here.cycles = 0", "at least 1"]),
        (Run, [1, 2], ["here = [1, 2]", "table"]),
    ],
)
def test_what_is_wrong_is_named_with_its_path(
    kind: type, data: object, fragments: list[str]
) -> None:
    with pytest.raises(ScenarioError) as caught:
        decode(kind, data, "here")
    assert str(caught.value).startswith("here")
    for fragment in fragments:
        assert fragment in str(caught.value)


def test_a_choice_is_one_of_a_table() -> None:
    assert choose("a", {"a": 1, "b": 2}, "here") == 1
    with pytest.raises(ScenarioError, match=r"here = 'c': .*known: a, b"):
        choose("c", {"a": 1, "b": 2}, "here")
    with pytest.raises(ScenarioError, match=r"here = 3: .*known: a, b"):
        choose(3, {"a": 1, "b": 2}, "here")


def test_an_unknown_key_of_the_whole_file_has_no_dot_before_it() -> None:
    with pytest.raises(ScenarioError, match=r"^bodi is unknown; did you mean 'body'"):
        refuse_unknown({"bodi": 1}, ["body", "run"], "")


def test_a_table_is_a_table() -> None:
    assert table({"x": 1}, "here") == {"x": 1}
    with pytest.raises(ScenarioError, match="here = 1: expected a table"):
        table(1, "here")
