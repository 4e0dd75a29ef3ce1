"""Units of ports, and how values convert between them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from functools import cache, partial
from typing import Final

import pint

from softbody_core.ground.errors import SimulationError

Dimension = frozenset[tuple[str, int]]

SI_BASE: Final = {
    "kg": "[mass]",
    "m": "[length]",
    "s": "[time]",
    "A": "[current]",
    "K": "[temperature]",
    "mol": "[substance]",
    "cd": "[luminosity]",
}
"""SI base units, and what pint calls the quantities that they measure."""

_FOREIGN: Final = re.compile(r"[^\w\s%°./*^()·⋅×⁻-]")
"""No part of a unit. Some versions of pint skip such a character, and read "m;s" as m·s."""

_DOT: Final = re.compile(r"(?<=[\w%°)])\s*\.\s*(?=[^\W\d]|[1%°(])")
_TOKEN: Final = re.compile(r"[^\s./*^()·⋅×]+")
_POWER: Final = re.compile(r"([A-Za-zµ°%]\w*?)(-?\d+)")
_NUMBER: Final = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY: Final = re.compile(rf"\s*({_NUMBER})(?:/(\d+))?\s*((?:1/)?[^\s\d+-][^+]*)?")


class UnitError(SimulationError, ValueError):
    """A unit or a quantity cannot be read, or two units do not measure the same thing."""


@dataclass(frozen=True)
class Unit:
    """A unit as a map to SI base units: value in SI = factor · value + offset.

    Attributes
    ----------
    symbol : str
        As written by whoever declared it.
    dimension : frozenset of (str, int)
        Powers of the SI base quantities.
    factor, offset : float
        Of the map.
    """

    symbol: str
    dimension: Dimension
    factor: float
    offset: float = 0.0

    def conversion_to(self, target: Unit) -> tuple[float, float]:
        """Factor and offset that turn values in this unit into values in `target`.

        Raises
        ------
        UnitError
            If the two do not measure the same thing.
        """
        if self.dimension != target.dimension:
            raise UnitError(f"{self.symbol!r} cannot be converted to {target.symbol!r}")
        if self.factor == target.factor and self.offset == target.offset:
            return 1.0, 0.0
        return self.factor / target.factor, (self.offset - target.offset) / target.factor


@cache
def unit(symbol: str) -> Unit:
    """Read a unit such as "cmH2O.s/L", "m3/s" or "1".

    Raises
    ------
    UnitError
        If the symbol is not known.
    """
    registry = _registry()
    try:
        units = registry.parse_units(symbol)
        base = registry.get_base_units(units)[1]
        at_0, at_1, at_2 = (
            registry.Quantity(Decimal(k), units).to(base).magnitude for k in range(3)
        )
        if not math.isclose(at_2 - at_1, at_1 - at_0):
            raise ValueError("its scale is not linear")  # such as dB
        dimension = frozenset((str(k), _whole(v)) for k, v in units.dimensionality.items())
    except Exception as error:  # pint's parser raises whatever Python's tokenizer raises
        raise UnitError(
            f"unit {symbol!r} is not known ({_reason(error)}); write it like 'L', 'cmH2O', 'L/s' "
            "or 'N.s/m'"
        ) from error
    return Unit(symbol, dimension, float(at_1 - at_0), float(at_0))


def quantity(text: str, symbol: str) -> float:
    """Read a quantity such as "1.25 L" or "1/30 s" and give its value in the unit `symbol`.

    Raises
    ------
    UnitError
        If the text is no quantity, has no unit, or has one that does not convert.
    """
    registry = _registry()
    example = f"write it with a unit of that kind, like '1 {symbol}'"
    parts = _QUANTITY.fullmatch(text)  # pint itself reads "1,25 L" as 125 L and "1 000 L" as 0 L
    if parts is None:
        raise UnitError(f"{text!r} is no quantity in {symbol!r}; {example}")
    try:
        source, target = (registry.parse_units(s) for s in (parts[3] or "", symbol))
        number = Decimal(parts[1]) / Decimal(parts[2] or 1)
        magnitude = float(registry.Quantity(number, source).to(target).magnitude)
    except pint.DimensionalityError as error:
        raise UnitError(f"{text!r} cannot be converted to {symbol!r}; {example}") from error
    except Exception as error:
        raise UnitError(
            f"{text!r} is no quantity in {symbol!r} ({_reason(error)}); {example}"
        ) from error
    if not math.isfinite(magnitude):
        raise UnitError(f"{text!r} is too large; {example}")
    return magnitude


@cache
def _registry() -> pint.UnitRegistry[Decimal]:
    # Decimal keeps "1.25 L" from picking up a rounding error on its way to m³.
    registry: pint.UnitRegistry[Decimal] = pint.UnitRegistry(non_int_type=Decimal)
    registry.preprocessors.append(partial(_as_pint_writes, registry))
    return registry


def _as_pint_writes(registry: pint.UnitRegistry[Decimal], text: str) -> str:
    """Write FMI's and UDUNITS' "N.s/m3" and "s-1" as pint's "N*s/m**3" and "s**-1".

    Raises
    ------
    ValueError
        If the text holds what belongs to no unit.
    """
    foreign = _FOREIGN.search(text)
    if foreign is not None:
        raise ValueError(f"{foreign[0]!r} is no part of a unit")
    if text.count("(") != text.count(")"):
        raise ValueError("its parentheses do not match")

    def token(match: re.Match[str]) -> str:
        power = _POWER.fullmatch(match[0])
        named = registry.parse_unit_name  # and "cmH2O" is a name, not a power
        if power is None or named(match[0]) or not named(power[1]):
            return match[0]
        return f"{power[1]}**{power[2]}"

    product = _DOT.sub("*", text)
    if re.search(r"\.(?!\d)|(?<!\d)\.", product):
        raise ValueError("'.' has to stand between two units")
    return _TOKEN.sub(token, product)


def _whole(power: object) -> int:
    """Power of a base quantity, which no unit of FMI has but as a whole number."""
    number = float(str(power))
    if not number.is_integer():
        raise ValueError(f"a power of {number:g} is no whole number")
    return int(number)


def _reason(error: Exception) -> str:
    """What is wrong with a unit, in pint's words where they are meant for people."""
    if isinstance(error, (pint.errors.PintError, ValueError)):
        return str(error).rstrip(".")
    return "it cannot be read"
