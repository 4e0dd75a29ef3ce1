"""Connections between ports: checked once, then a factor and an offset each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cosim.errors import SignalError, WiringError, nearest
from cosim.participant import Causality, Participant, Port
from cosim.units import UnitError


@dataclass(frozen=True)
class Connection:
    """From an output to an input, each written "participant.port"."""

    source: str
    target: str

    def __str__(self) -> str:
        """Source and target with an arrow."""
        return f"{self.source} → {self.target}"


@dataclass(frozen=True)
class Wire:
    """A checked connection with its conversion."""

    connection: Connection
    source: Participant
    output: str
    input: str
    factor: float
    offset: float


class Wiring:
    """All connections of a co-simulation.

    Parameters
    ----------
    participants : sequence of Participant
        All of them, with different names.
    connections : sequence of Connection
        Every input is connected exactly once, or at most once if it is optional.

    Raises
    ------
    WiringError
        If a name is unknown or used twice, units do not convert, or an input is left open.
    """

    def __init__(
        self, participants: Sequence[Participant], connections: Sequence[Connection]
    ) -> None:
        by_name = {participant.name: participant for participant in participants}
        if len(by_name) < len(participants):
            raise WiringError(f"participants need different names; got {sorted(by_name)}")
        self._wires: dict[str, list[Wire]] = {name: [] for name in by_name}
        taken: dict[str, Connection] = {}
        for connection in connections:
            source, output = _find(by_name, connection, connection.source, Causality.OUTPUT)
            target, entry = _find(by_name, connection, connection.target, Causality.INPUT)
            if connection.target in taken:
                raise WiringError(
                    f"input {connection.target} is connected twice: {taken[connection.target]} "
                    f"and {connection}; keep one"
                )
            taken[connection.target] = connection
            factor, offset = _conversion(connection, output, entry)
            wire = Wire(connection, source, output.name, entry.name, factor, offset)
            self._wires[target.name].append(wire)
        for participant in participants:
            for port in participant.ports.values():
                end = f"{participant.name}.{port.name}"
                required = port.causality is Causality.INPUT and not port.optional
                if required and end not in taken:
                    raise WiringError(f"input {end} is not connected; connect an output to it")

    def inputs_of(self, participant: Participant) -> dict[str, float]:
        """Collect what the other participants give this one, in the units of its ports.

        Raises
        ------
        SignalError
            If a value is NaN or infinite.
        """
        values = {}
        for wire in self._wires[participant.name]:
            value = wire.source.read()[wire.output]
            if not math.isfinite(value):
                raise SignalError(
                    f"connection {wire.connection} carries {value}; "
                    f"look at what {wire.source.name} computed in its last step"
                )
            values[wire.input] = wire.factor * value + wire.offset
        return values


def _find(
    participants: Mapping[str, Participant],
    connection: Connection,
    end: str,
    causality: Causality,
) -> tuple[Participant, Port]:
    name, _, port_name = end.partition(".")
    if name not in participants:
        raise WiringError(
            f"connection {connection}: no participant {name!r}; {nearest(name, participants)}"
        )
    fitting = {n: p for n, p in participants[name].ports.items() if p.causality is causality}
    if port_name not in fitting:
        raise WiringError(
            f"connection {connection}: {name} has no {causality.value} {port_name!r}; "
            f"{nearest(port_name, fitting)}"
        )
    return participants[name], fitting[port_name]


def _conversion(connection: Connection, output: Port, entry: Port) -> tuple[float, float]:
    if output.unit is None and entry.unit is None:
        return 1.0, 0.0
    if output.unit is None or entry.unit is None:
        silent = connection.source if output.unit is None else connection.target
        raise WiringError(
            f"connection {connection}: {silent} declares no unit, so it cannot be converted; "
            "declare one (in a pythonfmu class: units = {'delta_p': 'cmH2O'}), or give it in "
            "controller.ports"
        )
    try:
        return output.unit.conversion_to(entry.unit)
    except UnitError as error:
        raise WiringError(f"connection {connection}: {error}") from error
