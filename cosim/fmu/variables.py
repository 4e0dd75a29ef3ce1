"""Values of an FMU's variables: one call for all of a type, through arrays made once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial

from fmpy.model_description import ModelVariable

from cosim.fmu.calls import Calls
from cosim.fmu.description import elements, python_type


class FmuVariables:
    """Numeric variables that share a type.

    Parameters
    ----------
    calls : Calls
        The FMU, instantiated; not to be freed before the last call.
    variables : sequence of ModelVariable
        At least one.
    """

    def __init__(self, calls: Calls, variables: Sequence[ModelVariable]) -> None:
        kind, fmu, fmi = calls.kind(variables[0]), calls.fmu, calls.prefix
        references = [variable.valueReference for variable in variables]
        keys = (getattr(calls.types, f"{fmi}ValueReference") * len(references))(*references)
        self._names = [name for variable in variables for name in elements(variable)]
        self._convert = python_type(variables[0])
        self._values = (getattr(calls.types, f"{fmi}{kind}") * len(self._names))()
        arguments = [fmu.component, keys, len(references), self._values]
        if calls.counts_values:
            arguments.append(len(self._names))
        self._get = partial(getattr(fmu, f"{fmi}Get{kind}"), *arguments)
        self._set = partial(getattr(fmu, f"{fmi}Set{kind}"), *arguments)

    def read(self) -> dict[str, float]:
        """Values by name."""
        self._get()
        return dict(zip(self._names, map(float, self._values[:]), strict=True))

    def write(self, values: Mapping[str, float]) -> None:
        """Set all of them; `values` may hold others too. Integers take the nearest one.

        Raises
        ------
        OverflowError
            If an integer of the FMU's does not hold the value.
        """
        given = [values[name] for name in self._names]
        if self._convert is float:
            self._values[:] = given
        else:
            whole = [self._convert(round(value)) for value in given]
            self._values[:] = whole
            if list(map(int, self._values[:])) != whole:
                raise OverflowError("the value is out of the range of its type")
        self._set()


def by_type(calls: Calls, variables: Iterable[ModelVariable]) -> list[FmuVariables]:
    """Put variables of one type together."""
    groups: dict[str, list[ModelVariable]] = {}
    for variable in variables:
        groups.setdefault(calls.kind(variable), []).append(variable)
    return [FmuVariables(calls, group) for group in groups.values()]
