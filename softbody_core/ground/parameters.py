"""Parameters that carry their unit and their bounds.

A parameter class is a frozen dataclass that derives from `Parameters` and writes each number as
``Annotated[float, Quantity("N/m", at_least=0)]``. The bounds are checked whenever one is made, and
the unit is there for whoever reads values from a file.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass
from functools import cache
from typing import Any, cast, get_args, get_type_hints

from softbody_core.ground.errors import ParameterError


@dataclass(frozen=True)
class Quantity:
    """Unit and admissible range of a number.

    Parameters
    ----------
    unit : str
        SI unit, in a form that UDUNITS and pint understand ("N.s/m"); "1" for a plain number.
    at_least : float, optional
        Smallest admissible value.
    above : float, optional
        Bound that the value has to exceed.
    below : float, optional
        Bound that the value must not reach.
    """

    unit: str
    at_least: float | None = None
    above: float | None = None
    below: float | None = None

    def check(self, name: str, value: float) -> None:
        """Raise `ParameterError` unless `value` is finite and within the bounds."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        if not math.isfinite(value):
            raise ParameterError(f"{name} = {value}{unit}: expected a finite number")
        if self.at_least is not None and value < self.at_least:
            raise ParameterError(f"{name} = {value:g}{unit}: expected at least {self.at_least:g}")
        if self.above is not None and value <= self.above:
            raise ParameterError(f"{name} = {value:g}{unit}: expected more than {self.above:g}")
        if self.below is not None and value >= self.below:
            raise ParameterError(f"{name} = {value:g}{unit}: expected less than {self.below:g}")


def quantities_of(parameters: type[Any]) -> dict[str, Quantity]:
    """Fields of a parameter class that are annotated with a `Quantity`, by name."""
    return _quantities_of(cast("Hashable", parameters))


@cache
def _quantities_of(parameters: Hashable) -> dict[str, Quantity]:
    hints = get_type_hints(parameters, include_extras=True)
    return {
        name: argument
        for name, hint in hints.items()
        for argument in get_args(hint)
        if isinstance(argument, Quantity)
    }


@dataclass(frozen=True)
class Parameters:
    """Base of the frozen parameter classes: checks every annotated quantity.

    Raises
    ------
    ParameterError
        If a value is not finite or outside its bounds; the message names class, field and value.
    """

    def __post_init__(self) -> None:
        """Check all fields that carry a `Quantity`."""
        for name, quantity in quantities_of(type(self)).items():
            value = getattr(self, name)
            if value is not None:
                for part in value if isinstance(value, tuple) else (value,):
                    quantity.check(f"{type(self).__name__}.{name}", part)
