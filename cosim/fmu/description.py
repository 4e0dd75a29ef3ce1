"""What an FMU says of itself, checked before it runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import fmpy
import numpy as np
from fmpy.model_description import ModelDescription, ModelVariable

from cosim.errors import FmuError
from cosim.fmu.folder import FmuFolder
from cosim.participant import Causality, Port, Variability
from cosim.units import SI_BASE, Unit, UnitError, unit

NUMBERS: Final = frozenset(
    {"Real", "Integer", "Boolean", "Enumeration", "Float64", "Float32"}
    | {f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)}
)
"""Types of FMI 1.0, 2.0 and 3.0 whose values can cross a connection."""


def read_description(path: Path, folder: FmuFolder) -> ModelDescription:
    """Read and check the model description of an unpacked FMU.

    Raises
    ------
    FmuError
        If it cannot be read, or is no co-simulation of FMI 1.0, 2.0 or 3.0.
    """
    try:
        description = fmpy.read_model_description(str(folder.path), validate=False)
    except Exception as error:  # lxml and fmpy raise plain exceptions
        raise FmuError(
            f"FMU {path}: its modelDescription.xml cannot be read ({error}); expected one of FMI "
            "1.0, 2.0 or 3.0"
        ) from error
    if description.coSimulation is None:
        raise FmuError(
            f"FMU {path} offers no co-simulation (only model exchange); export it as one that does"
        )
    return description


def ports_of(path: Path, description: ModelDescription) -> dict[str, Port]:
    """Numeric inputs and outputs as ports with their units, one an element of an array.

    Raises
    ------
    FmuError
        If an input or output has a variability that does not change.
    """
    units = declared_units(path, description)
    ports = {}
    for variable in description.modelVariables:
        if variable.type not in NUMBERS or variable.causality not in ("input", "output"):
            continue
        if variable.variability not in (None, "continuous", "discrete"):
            raise FmuError(
                f"FMU {path}: {variable.causality} {variable.name} has variability "
                f"{variable.variability!r}; expected continuous or discrete"
            )
        causality, variability = Causality(variable.causality), _variability(variable)
        for name in elements(variable):
            ports[name] = Port(
                name,
                unit_of(path, variable, units),
                causality,
                variable.description or "",
                variability=variability,
            )
    return ports


def _variability(variable: ModelVariable) -> Variability:
    if python_type(variable) is not float:
        return Variability.MODE
    discrete = variable.variability == "discrete"
    return Variability.SAMPLED if discrete else Variability.CONTINUOUS


def elements(variable: ModelVariable) -> list[str]:
    """Names of what a variable holds: its own; or ``y[0]``, ``y[1]`` … of an array, row by row."""
    if not variable.dimensions:
        return [variable.name]
    return [f"{variable.name}[{','.join(map(str, i))}]" for i in np.ndindex(variable.shape)]


def resize(description: ModelDescription, sizes: Mapping[str, Any]) -> None:
    """Give arrays the shape that structural parameters, by name, ask for."""
    for variable in description.modelVariables:
        variable.shape = tuple(
            int(size.start if size.variable is None else sizes.get(size.variable.name, length))
            for size, length in zip(variable.dimensions, variable.shape, strict=True)
        )


def python_type(variable: ModelVariable) -> type[float] | type[int] | type[bool] | type[str]:
    """Python type that holds a variable's values."""
    if variable.type in ("Real", "Float64", "Float32"):
        return float
    if variable.type == "Boolean":
        return bool
    return str if variable.type == "String" else int


def unit_of(path: Path, variable: ModelVariable, units: Mapping[str, Unit]) -> Unit | None:
    """Unit of a variable, or of its declared type; None for a variable without one."""
    symbol = _symbol(variable)
    if symbol is None:
        return None
    if symbol not in units:
        raise FmuError(
            f"FMU {path}: unit {symbol!r} of {variable.name} is neither declared in its "
            "UnitDefinitions nor known; declare it with a BaseUnit"
        )
    return units[symbol]


def _symbol(variable: ModelVariable) -> str | None:
    declared_type = variable.declaredType
    return variable.unit or (declared_type.unit if declared_type is not None else None)


def declared_units(path: Path, description: ModelDescription) -> dict[str, Unit]:
    """Units in use, from their BaseUnit where there is one and from their name otherwise.

    Raises
    ------
    FmuError
        If name and BaseUnit disagree: a controller that says cmH2O and means Pa.
    """
    used = {symbol for v in description.modelVariables if (symbol := _symbol(v)) is not None}
    declared = {u.name: u.baseUnit for u in description.unitDefinitions if u.baseUnit is not None}
    units: dict[str, Unit] = {}
    for symbol in used:
        try:
            known: Unit | None = unit(symbol)
        except UnitError:
            known = None
        if symbol in declared:
            units[symbol] = _from_base(symbol, declared[symbol])
            if known is not None and not _agree(known, units[symbol]):
                raise FmuError(
                    f"FMU {path}: unit {symbol!r} is declared as {_in_base_units(units[symbol])}, "
                    f"but {symbol} is {_in_base_units(known)}; correct its BaseUnit"
                )
        elif known is not None:
            units[symbol] = known
    return units


def _from_base(symbol: str, base: object) -> Unit:
    dimension = frozenset(
        (name, power) for si, name in SI_BASE.items() if (power := int(getattr(base, si, 0)))
    )
    factor, offset = float(getattr(base, "factor", 1.0)), float(getattr(base, "offset", 0.0))
    return Unit(symbol, dimension, factor, offset)


def _in_base_units(value: Unit) -> str:
    base = [f"{name}^{power}" for name, power in sorted(value.dimension)]
    offset = f" + {value.offset:.9g}" if value.offset else ""
    return " ".join([f"{value.factor:.9g}", *base]) + offset


def _agree(known: Unit, declared: Unit) -> bool:
    # Factors are often written with six digits, as 98.0665 or 0.0101972.
    factors = math.isclose(known.factor, declared.factor, rel_tol=1e-5)
    offsets = math.isclose(known.offset, declared.offset, rel_tol=1e-5)
    return known.dimension == declared.dimension and factors and offsets
