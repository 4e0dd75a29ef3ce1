"""From communication points to an xarray dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from cosim.errors import WiringError, nearest
from cosim.loop import CommunicationPoint
from cosim.participant import Participant
from cosim.units import unit
from softbody_core.ground.arrays import Floats


@dataclass(frozen=True)
class RecordedVariable:
    """A variable of the dataset and the outputs that it records.

    Attributes
    ----------
    name : str
        In the dataset.
    sources : tuple of str
        "participant.port"; one, or three for a variable along the dimension ``axis``, or any number
        that are added.
    units : str or None
        In the dataset, converted from the port's; None keeps the port's own unit. A port that
        declares none is recorded as it is, with units "unknown".
    long_name : str
        For axes of plots.
    attributes : mapping
        Further attributes.
    added : bool
        The sources are added.
    """

    name: str
    sources: tuple[str, ...]
    units: str | None
    long_name: str
    attributes: Mapping[str, object] = field(default_factory=dict)
    added: bool = False


class Recorder:
    """Records outputs at every communication point.

    Parameters
    ----------
    participants : sequence of Participant
        Whose ports are recorded.
    variables : sequence of RecordedVariable
        What to record; all sources must exist.
    """

    def __init__(
        self, participants: Sequence[Participant], variables: Sequence[RecordedVariable]
    ) -> None:
        self._variables = variables
        self._ends = [
            (owner, port)
            for variable in variables
            for owner, _, port in (source.partition(".") for source in variable.sources)
        ]
        units = {
            f"{participant.name}.{port.name}": port.unit
            for participant in participants
            for port in participant.ports.values()
        }
        for end in map(".".join, self._ends):
            if end not in units:
                raise WiringError(f"nothing to record is named {end}; {nearest(end, units)}")
        self._port_units = [units[f"{owner}.{port}"] for owner, port in self._ends]
        self._times: list[float] = []
        self._rows: list[list[float]] = []

    def record(self, point: CommunicationPoint) -> None:
        """Record one point."""
        self._times.append(point.time)
        self._rows.append([point.outputs[owner][port] for owner, port in self._ends])

    def serialize(self) -> Floats:
        """Everything that was recorded, in the ports' units: a row a point, its time first."""
        return np.column_stack([np.array(self._times), np.array(self._rows)])

    def deserialize(self, rows: Floats) -> None:
        """Start from what `serialize` gave, in place of what is there."""
        self._times, self._rows = rows[:, 0].tolist(), rows[:, 1:].tolist()

    def dataset(self) -> xr.Dataset:
        """Everything that was recorded, in the units of the variables."""
        columns = iter(np.array(self._rows).reshape(-1, len(self._ends)).T)
        port_units = iter(self._port_units)
        data: dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, object]]] = {}
        for variable in self._variables:
            series = []
            symbol = variable.units
            for _ in variable.sources:
                values, port_unit = next(columns), next(port_units)
                if port_unit is None:
                    symbol = "1" if symbol in (None, "1") else "unknown"
                elif symbol is None:
                    symbol = port_unit.symbol
                else:
                    factor, offset = port_unit.conversion_to(unit(symbol))
                    values = factor * values + offset
                series.append(values)
            attributes = {
                "units": symbol,
                "long_name": variable.long_name,
                **variable.attributes,
            }
            if len(series) == 1 or variable.added:
                data[variable.name] = (("time",), sum(series[1:], series[0]), attributes)
            else:
                data[variable.name] = (("time", "axis"), np.stack(series, axis=1), attributes)
        time = ("time", np.array(self._times), {"units": "s", "long_name": "simulated time"})
        axis = ("axis", np.array(["x", "y", "z"]), {"long_name": "coordinate axis"})
        return xr.Dataset(data, coords={"time": time, "axis": axis})
