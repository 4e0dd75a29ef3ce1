from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim import UnitError, quantity, unit

# SI factors by definition: 1 cmH2O is 98.0665 Pa exactly.
FACTORS = {
    "cmH2O": 98.0665,
    "mmHg": pytest.approx(133.322387415, rel=1e-9),  # the conventional millimetre of mercury
    "cmH2O.s/L": 98066.5,
    "L": 1e-3,
    "L/s": 1e-3,
    "mL": 1e-6,
    "m3/s": 1.0,
    "m^3": 1.0,
    "m**3": 1.0,
    "s-1": 1.0,
    "L.s-1": 1e-3,
    "1/min": 1 / 60,
    "cmH2O-1": pytest.approx(1 / 98.0665, rel=1e-15),  # one rounding
    "N.s/m": 1.0,
    "1": 1.0,
    "%": 0.01,
}
PRESSURES = ["Pa", "kPa", "cmH2O", "mmHg", "bar"]
TEMPERATURES = ["K", "degC", "degF"]


@pytest.mark.parametrize("symbol", FACTORS)
def test_factor_to_si_is_the_defined_one(symbol: str) -> None:
    assert unit(symbol).factor == FACTORS[symbol]
    assert unit(symbol).offset == 0.0


def test_temperature_scale_has_an_offset() -> None:
    assert (unit("degC").factor, unit("degC").offset) == (1.0, 273.15)


@pytest.mark.parametrize(
    ("first", "other"),
    [("m3/s", "m3.s-1"), ("m^3", "m3"), ("N.s/m", "kg/s"), ("cmH2O.s/L", "Pa.s/m3"), ("J", "N.m")],
)
def test_spellings_of_one_dimension_agree(first: str, other: str) -> None:
    assert unit(first).dimension == unit(other).dimension


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from([PRESSURES, TEMPERATURES]).flatmap(
        lambda names: st.tuples(st.sampled_from(names), st.sampled_from(names))
    ),
    st.floats(-1e6, 1e6),
)
def test_there_and_back_is_the_same_value(pair: tuple[str, str], value: float) -> None:
    first, other = map(unit, pair)
    factor, offset = first.conversion_to(other)
    back, back_offset = other.conversion_to(first)
    # A few roundings, of the value and of offsets of up to 460 degrees.
    assert back * (factor * value + offset) + back_offset == pytest.approx(
        value, rel=1e-14, abs=1e-12
    )


def test_same_unit_converts_to_the_bit() -> None:
    assert unit("cmH2O").conversion_to(unit("cmH2O")) == (1.0, 0.0)


@pytest.mark.parametrize("symbol", ["xyz", "cmH20", "5", "2 L", "(", "m-", "kg+m", "dB/"])
def test_unknown_unit_is_refused_by_name(symbol: str) -> None:
    with pytest.raises(UnitError) as caught:
        unit(symbol)
    assert repr(symbol) in str(caught.value)


# pint 0.25 reads each of these as m·s or ms: it skips what it does not know.
@pytest.mark.parametrize("joint", [*";:,!@~|&=<?$`\\'\"#[{", ".."])
def test_only_a_product_or_a_quotient_joins_units(joint: str) -> None:
    with pytest.raises(UnitError) as caught:
        unit(f"m{joint}s")
    assert repr(f"m{joint}s") in str(caught.value)


@pytest.mark.parametrize("symbol", [".m", "m.", "m.s.", "m..2", "m.2", "m.-s"])
def test_a_dot_stands_between_two_units(symbol: str) -> None:
    with pytest.raises(UnitError, match="has to stand between two units"):
        unit(symbol)


@pytest.mark.parametrize("symbol", ["dB", "m^0.5", "m**2.5"])
def test_a_unit_that_fmi_cannot_say_is_refused(symbol: str) -> None:
    with pytest.raises(UnitError, match=r"no whole number|not linear|not known"):
        unit(symbol)


NAMES = ["m", "s", "kg", "L", "cmH2O", "Pa", "mL", "min", "J", "N", "K"]
POWERS = [-3, -2, -1, 1, 2, 3]


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(NAMES), st.sampled_from(POWERS)), min_size=1, max_size=4))
def test_a_product_of_powers_has_the_product_of_the_factors(parts: list[tuple[str, int]]) -> None:
    symbol = ".".join(f"{name}{power}" for name, power in parts)
    expected = math.prod(unit(name).factor ** power for name, power in parts)
    # At most a dozen factors, each with a rounding of its own.
    assert unit(symbol).factor == pytest.approx(expected, rel=1e-14)


def test_what_the_library_says_of_a_unit_is_in_the_message() -> None:
    with pytest.raises(UnitError, match="'cmH20' is not defined in the unit registry"):
        unit("cmH20")
    with pytest.raises(UnitError, match="'xyz' is not defined in the unit registry"):
        quantity("1 xyz", "L")


@pytest.mark.parametrize(("first", "other"), [("L", "cmH2O"), ("m3", "m3/s"), ("s", "s-1")])
def test_units_of_different_things_do_not_convert(first: str, other: str) -> None:
    with pytest.raises(UnitError, match="cannot be converted"):
        unit(first).conversion_to(unit(other))


@pytest.mark.parametrize(
    ("text", "symbol", "value"),
    [
        ("1.25 L", "m^3", 1.25e-3),
        ("0.1 L", "m3", 1e-4),
        ("1e-3 L", "m3", 1e-6),
        ("1.e3 L", "m3", 1.0),
        ("  -3cmH2O ", "Pa", -294.1995),
        ("10 cmH2O.s/L", "Pa.s/m3", 980665.0),
        ("12 1/min", "s-1", 0.2),
        ("30 %", "1", 0.3),
        ("1.5", "1", 1.5),
        ("20 degC", "K", 293.15),
    ],
)
def test_quantity_is_the_nearest_number(text: str, symbol: str, value: float) -> None:
    assert quantity(text, symbol) == value  # decimal on the way, so one rounding at the end


@settings(max_examples=60, deadline=None)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_quantity_in_its_own_unit_is_the_number_written(value: float) -> None:
    assert quantity(f"{value!r} L", "L") == value


# Each of these would be a wrong number, or none, if it were accepted.
@pytest.mark.parametrize(
    "text",
    [
        *("", " ", "L", "1", "nan L", "inf L", "1e999 L", "1,25 L", "1 000 L", "1+1 L", "1 2 L"),
        *("1 s", "one L", "1 xyz", "__import__('os')", "1.2.3 L", "1 L L"),
    ],
)
def test_what_is_no_volume_is_refused_as_one(text: str) -> None:
    with pytest.raises(UnitError) as caught:
        quantity(text, "L")
    assert repr(text) in str(caught.value)
