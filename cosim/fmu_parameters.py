"""Values for an FMU's parameters: known names, the FMU's units, its types and bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable

from cosim.errors import FmuError, nearest
from cosim.fmu_description import declared_units, unit_of
from cosim.units import Unit, UnitError, quantity

Value = float | int | bool | str


def checked_parameters(
    path: Path, description: ModelDescription, parameters: Mapping[str, Value]
) -> dict[str, Value]:
    """Bring parameters into the FMU's units and types.

    Parameters
    ----------
    path : Path
        The FMU, for messages.
    description : ModelDescription
        What it says of itself.
    parameters : mapping
        Values by name; one with a unit is text such as "1.25 L".

    Raises
    ------
    FmuError
        For an unknown name, or a value without its unit, of the wrong type, or out of bounds.
    """
    known = {
        variable.name: variable
        for variable in description.modelVariables
        if variable.causality in ("parameter", "structuralParameter")
    }
    for name in parameters:
        if name not in known:
            raise FmuError(f"FMU {path} has no parameter {name!r}; {nearest(name, known)}")
    units = declared_units(path, description)
    return {
        name: _checked(known[name], unit_of(path, known[name], units), value)
        for name, value in parameters.items()
    }


def _checked(variable: ModelVariable, own: Unit | None, value: Value) -> Value:
    name = variable.name
    if python_type(variable) is str:
        return str(value)
    if own is not None and own.symbol != "1":
        value = _quantity(name, value, own.symbol)
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


def accessor(variable: ModelVariable) -> str:
    """Name of the type in fmpy's getters and setters."""
    return "Integer" if variable.type == "Enumeration" else str(variable.type)


def python_type(variable: ModelVariable) -> type[float] | type[int] | type[bool] | type[str]:
    """Python type that holds the variable's values."""
    if variable.type in ("Real", "Float64", "Float32"):
        return float
    if variable.type == "Boolean":
        return bool
    return str if variable.type == "String" else int
