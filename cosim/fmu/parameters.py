"""Values for an FMU's parameters: known names, the FMU's units, its types and bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable

from cosim.errors import FmuError, nearest
from cosim.fmu.description import declared_units, elements, python_type, resize, unit_of
from cosim.units import Unit, UnitError, quantity

Value = float | int | bool | str


@dataclass(frozen=True)
class Assignment:
    """A parameter and its value in the FMU's units, or those of all its elements."""

    variable: ModelVariable
    values: list[Value]

    def __str__(self) -> str:
        """Name and value, for messages."""
        value = self.values if self.variable.dimensions else self.values[0]
        return f"{self.variable.name} = {value!r}"


def checked_parameters(
    path: Path, description: ModelDescription, parameters: Mapping[str, Value]
) -> list[Assignment]:
    """Bring parameters into the FMU's units and types.

    Structural parameters come first, and decide the shapes of the arrays in `description`.

    Parameters
    ----------
    path : Path
        The FMU, for messages.
    description : ModelDescription
        What it says of itself.
    parameters : mapping
        Values by name; one with a unit is text such as "1.25 L". Elements of an array are named
        like those of a port, and keep their start values where they are not given.

    Raises
    ------
    FmuError
        For an unknown name, or a value without its unit, of the wrong type, or out of bounds.
    """
    units = declared_units(path, description)

    def value(name: str, variable: ModelVariable) -> Value:
        return _checked(name, variable, unit_of(path, variable, units), parameters[name])

    structural = {
        variable.name: variable
        for variable in description.modelVariables
        if variable.causality == "structuralParameter"
    }
    sizes = {name: value(name, v) for name, v in structural.items() if name in parameters}
    resize(description, sizes)
    known = {
        name: (variable, index)
        for variable in description.modelVariables
        if variable.causality == "parameter"
        for index, name in enumerate(elements(variable))
    }
    assignments = {name: Assignment(structural[name], [size]) for name, size in sizes.items()}
    for name in parameters:
        if name in sizes:
            continue
        if name not in known:
            names = [*structural, *known]
            raise FmuError(f"FMU {path} has no parameter {name!r}; {nearest(name, names)}")
        variable, index = known[name]
        if variable.name not in assignments:
            assignments[variable.name] = Assignment(variable, start_values(path, variable))
        assignments[variable.name].values[index] = value(name, variable)
    return list(assignments.values())


def start_values(path: Path, variable: ModelVariable) -> list[Value]:
    """Values that a variable starts with, one an element; 0 or empty where it does not say.

    Raises
    ------
    FmuError
        If an array has start values for another number of elements than it has.
    """
    kind, count = python_type(variable), len(elements(variable))
    if kind is str:
        return [""] * count
    starts = (variable.start or "0").split()
    if len(starts) not in (1, count):
        raise FmuError(
            f"FMU {path}: {variable.name} has {count} elements and {len(starts)} start values; "
            "expected one for each"
        )
    values = [text in ("true", "1") if kind is bool else kind(float(text)) for text in starts]
    return values * (count if len(starts) == 1 else 1)


def _checked(name: str, variable: ModelVariable, declared: Unit | None, value: Value) -> Value:
    if python_type(variable) is str:
        return str(value)
    if declared is not None and declared.symbol != "1":
        value = _quantity(name, value, declared.symbol)
    try:
        number = _number(variable, value)
    except (TypeError, ValueError) as error:
        raise FmuError(f"parameter {name} = {value!r}: expected {variable.type}") from error
    lowest, highest = (
        None if bound is None else float(bound) for bound in (variable.min, variable.max)
    )
    if lowest is not None and float(number) < lowest:
        raise FmuError(f"parameter {name} = {value}: expected at least {lowest:g}")
    if highest is not None and float(number) > highest:
        raise FmuError(f"parameter {name} = {value}: expected at most {highest:g}")
    return number  # type: ignore[no-any-return]


def _quantity(name: str, value: Value, symbol: str) -> float:
    if not isinstance(value, str):
        raise FmuError(
            f"parameter {name} = {value!r} has no unit; write it like '{value} {symbol}'"
        )
    try:
        return quantity(value, symbol)
    except UnitError as error:
        raise FmuError(f"parameter {name}: {error}") from error


def _number(variable: ModelVariable, value: Value) -> Any:
    """Value as the variable's type takes it; ValueError if that would change or not be finite."""
    number: Any = python_type(variable)(value)
    if not math.isfinite(number) or (not isinstance(value, str) and number != value):
        raise ValueError
    if isinstance(number, bool) and isinstance(value, str):  # bool("false") is True
        raise ValueError
    return number
