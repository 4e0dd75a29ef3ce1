"""Values of an FMU's variables: one call for all of a type, through arrays made once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from fmpy import fmi2, fmi3
from fmpy.model_description import ModelVariable

from cosim.fmu_parameters import Value, accessor, python_type


class FmuVariables:
    """Numeric variables that share a type.

    Parameters
    ----------
    fmu : FMU2Slave or FMU3Slave
        Instantiated; not to be freed before the last call.
    variables : sequence of ModelVariable
        At least one.
    """

    def __init__(self, fmu: Any, variables: Sequence[ModelVariable]) -> None:
        kind, n = accessor(variables[0]), len(variables)
        types, fmi = (fmi3, "fmi3") if isinstance(fmu, fmi3.FMU3Slave) else (fmi2, "fmi2")
        references = [variable.valueReference for variable in variables]
        keys = (getattr(types, f"{fmi}ValueReference") * n)(*references)
        self._names = [variable.name for variable in variables]
        self._convert = python_type(variables[0])
        self._values = (getattr(types, f"{fmi}{kind}") * n)()
        arguments = [fmu.component, keys, n, self._values]
        if types is fmi3:
            arguments.append(n)  # it counts values too, for arrays
        self._get = partial(getattr(fmu, f"{fmi}Get{kind}"), *arguments)
        self._set = partial(getattr(fmu, f"{fmi}Set{kind}"), *arguments)

    def read(self) -> dict[str, float]:
        """Values by name."""
        self._get()
        return dict(zip(self._names, map(float, self._values), strict=True))

    def write(self, values: Mapping[str, float]) -> None:
        """Set all of them; `values` may hold others too."""
        self._values[:] = [self._convert(values[name]) for name in self._names]
        self._set()


def by_type(fmu: Any, variables: Iterable[ModelVariable]) -> list[FmuVariables]:
    """Put variables of one type together."""
    groups: dict[str, list[ModelVariable]] = {}
    for variable in variables:
        groups.setdefault(accessor(variable), []).append(variable)
    return [FmuVariables(fmu, group) for group in groups.values()]


def set_one(fmu: Any, variable: ModelVariable, value: Value) -> None:
    """Set one variable of any type."""
    setter = getattr(fmu, f"set{accessor(variable)}")
    setter([variable.valueReference], [python_type(variable)(value)])
