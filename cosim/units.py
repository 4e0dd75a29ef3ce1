"""Units of ports, and how values convert between them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from functools import cache
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

_TOKEN: Final = re.compile(r"[^\s./*^()·]+")
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
        units = registry.parse_units(_with_powers(symbol))
        base = registry.get_base_units(units)[1]
        one, zero = (registry.Quantity(Decimal(k), units).to(base).magnitude for k in (1, 0))
    except Exception as error:  # pint's parser raises whatever Python's tokenizer raises
        raise UnitError(
            f"unit {symbol!r} is not known; write it like 'L', 'cmH2O', 'L/s' or 'N.s/m'"
        ) from error
    dimension = frozenset((str(k), round(float(str(v)))) for k, v in units.dimensionality.items())
    return Unit(symbol, dimension, float(one - zero), float(zero))


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
        own, target = (registry.parse_units(_with_powers(s)) for s in (parts[3] or "", symbol))
        number = Decimal(parts[1]) / Decimal(parts[2] or 1)
        magnitude = float(registry.Quantity(number, own).to(target).magnitude)
    except pint.DimensionalityError as error:
        raise UnitError(f"{text!r} cannot be converted to {symbol!r}; {example}") from error
    except Exception as error:
        raise UnitError(f"{text!r} is no quantity in {symbol!r}; {example}") from error
    if not math.isfinite(magnitude):
        raise UnitError(f"{text!r} is too large; {example}")
    return magnitude


@cache
def _registry() -> pint.UnitRegistry[Decimal]:
    # Decimal keeps "1.25 L" from picking up a rounding error on its way to m³.
    return pint.UnitRegistry(non_int_type=Decimal)


def _with_powers(text: str) -> str:
    """Write powers as pint does: FMI's and UDUNITS' "m3/s" and "s-1" become "m**3/s", "s**-1"."""

    def token(match: re.Match[str]) -> str:
        power = _POWER.fullmatch(match[0])
        if power is None or (power[2][0] != "-" and match[0] in _registry()):
            return match[0]
        return f"{power[1]}**{power[2]}"

    return _TOKEN.sub(token, text)
