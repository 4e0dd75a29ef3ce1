"""Values of an FMU's variables: one call for all of a type, through arrays made once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

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
        kind = calls.kind(variables[0])
        references = [variable.valueReference for variable in variables]
        self._names = [name for variable in variables for name in elements(variable)]
        self._convert = python_type(variables[0])
        self._c_type = calls.c_type(kind)
        self._get, self._set = calls.exchange(kind, references, len(self._names))

    def read(self) -> dict[str, float]:
        """Values by name."""
        return dict(zip(self._names, map(float, self._get()), strict=True))

    def write(self, values: Mapping[str, float]) -> None:
        """Set all of them; `values` may hold others too. Integers take the nearest one.

        Raises
        ------
        OverflowError
            If an integer of the FMU's does not hold the value.
        """
        given = [values[name] for name in self._names]
        if self._convert is not float:
            given = [self._whole(value) for value in given]
        self._set(given)

    def _whole(self, value: float) -> float:
        whole = self._convert(round(value))
        if self._convert is int and self._c_type(whole).value != whole:
            raise OverflowError("the value is out of the range of its type")
        return whole  # type: ignore[return-value]


def by_type(calls: Calls, variables: Iterable[ModelVariable]) -> list[FmuVariables]:
    """Put variables of one type together."""
    groups: dict[str, list[ModelVariable]] = {}
    for variable in variables:
        groups.setdefault(calls.kind(variable), []).append(variable)
    return [FmuVariables(calls, group) for group in groups.values()]
