"""What an exported FMU shows of the participant inside it, and how that is kept in its file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import msgspec

from cosim.participant import Port

INTERFACE: Final = "interface.json"
"""Name of the file in the FMU's resources."""

Number = float | int


@dataclass(frozen=True)
class Variable:
    """One variable of an exported FMU.

    Attributes
    ----------
    name : str
        Of the participant's port, or of the parameter.
    causality : {"input", "output", "parameter"}
        As in FMI.
    description : str
        For people.
    unit : str or None
        Unit of the values that cross the FMU's border; None for a whole number.
    start : float or int or None
        None for an output; an int for a variable of whole numbers.
    minimum, maximum : float or int or None
        Bounds of a parameter or input.
    """

    name: str
    causality: Literal["input", "output", "parameter"]
    description: str = ""
    unit: str | None = None
    start: Number | None = None
    minimum: Number | None = None
    maximum: Number | None = None

    @property
    def is_whole(self) -> bool:
        """Whether its values are whole numbers."""
        return isinstance(self.start, int)


@dataclass(frozen=True)
class Interface:
    """All that is known of an exported FMU before it runs.

    Attributes
    ----------
    title : str
        The FMU's description.
    version : str
        Of the package that the FMU needs.
    step, stop : float
        Communication step and end of the default experiment, s.
    variables : tuple of Variable
        In the order of their value references.
    """

    title: str
    version: str
    step: float
    stop: float
    variables: tuple[Variable, ...]

    @property
    def units(self) -> dict[str, str]:
        """Units of the variables that have one."""
        return {v.name: v.unit for v in self.variables if v.unit is not None}

    @property
    def bounds(self) -> dict[str, tuple[Number | None, Number | None]]:
        """Least and largest values, or None."""
        return {v.name: (v.minimum, v.maximum) for v in self.variables}

    def write(self, folder: Path) -> Path:
        """Write it down in a folder, for `read`."""
        path = folder / INTERFACE
        path.write_bytes(msgspec.json.format(msgspec.json.encode(self), indent=1))
        return path

    @classmethod
    def read(cls, folder: Path) -> Interface:
        """Read what `write` wrote; the values are the same to the bit."""
        return msgspec.json.decode((folder / INTERFACE).read_bytes(), type=cls)


def ports_as_variables(
    ports: Mapping[str, Port],
    units: Mapping[str, str],
    starts: Mapping[str, float],
    bounds: Mapping[str, float],
) -> list[Variable]:
    """Describe a participant's ports as variables of an FMU.

    Parameters
    ----------
    ports : mapping
        By name.
    units : mapping
        Units that take the place of the ports' own, by name; they have to convert.
    starts : mapping
        Start values of all inputs, in the variables' units.
    bounds : mapping
        Least values of inputs, where they have one.
    """
    return [
        Variable(
            name,
            port.causality.value,
            port.description,
            units.get(name, "1" if port.unit is None else port.unit.symbol),
            starts.get(name),
            bounds.get(name),
        )
        for name, port in ports.items()
    ]
