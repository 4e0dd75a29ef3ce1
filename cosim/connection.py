"""Connections between ports: checked once, then a factor and an offset each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

from cosim.errors import SignalError, WiringError, nearest
from cosim.participant import Causality, Participant, Port, Variability
from cosim.units import UnitError


@dataclass(frozen=True)
class Connection:
    """From an output to an input, each written "participant.port".

    Attributes
    ----------
    source : str
        The output.
    target : str
        The input.
    added : tuple of str
        Further outputs, which are added to the first one.
    """

    source: str
    target: str
    added: tuple[str, ...] = ()

    @property
    def sources(self) -> tuple[str, ...]:
        """All outputs that add up."""
        return (self.source, *self.added)

    def __str__(self) -> str:
        """Sources and target with an arrow."""
        return f"{' + '.join(self.sources)} → {self.target}"


@dataclass(frozen=True, eq=False)
class Term:
    """One output that reaches an input, and the factor between their units.

    Attributes
    ----------
    continuous : bool
        The output is continuous, and who takes it does not merely sample it.
    """

    source: Participant
    output: str
    factor: float
    continuous: bool


@dataclass(frozen=True, eq=False)
class Wire:
    """A checked connection: input = Σ factor · output + offset."""

    connection: Connection
    terms: tuple[Term, ...]
    input: str
    offset: float

    def value(self, given: Callable[[Term], float]) -> float:
        """Value of the input, in its own unit, from values of the outputs.

        Raises
        ------
        SignalError
            If a value is NaN or infinite.
        """
        total = self.offset
        for term in self.terms:
            value = given(term)
            if not isfinite(value):
                raise SignalError(
                    f"connection {self.connection} carries {value}; "
                    f"look at what {term.source.name} computed in its last step"
                )
            total += term.factor * value
        return total


def now(term: Term) -> float:
    """What an output gives at this moment."""
    return term.source.read()[term.output]


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
            target, entry = _find(by_name, connection, connection.target, Causality.INPUT)
            if connection.target in taken:
                raise WiringError(
                    f"input {connection.target} is connected twice: {taken[connection.target]} "
                    f"and {connection}; keep one, or let one connection add several outputs"
                )
            taken[connection.target] = connection
            self._wires[target.name].append(_wire(by_name, connection, target, entry))
        for participant in participants:
            for port in participant.ports.values():
                end = f"{participant.name}.{port.name}"
                required = port.causality is Causality.INPUT and not port.optional
                if required and end not in taken:
                    raise WiringError(f"input {end} is not connected; connect an output to it")

    def inputs_of(
        self, participant: Participant, given: Callable[[Term], float] = now
    ) -> dict[str, float]:
        """Collect what the other participants give this one, in the units of its ports.

        Parameters
        ----------
        participant : Participant
            Whose inputs.
        given : callable, optional
            Value of an output, in its own unit; by default what it gives at this moment.

        Raises
        ------
        SignalError
            If a value is NaN or infinite.
        """
        return {wire.input: wire.value(given) for wire in self._wires[participant.name]}

    def terms_of(self, participant: Participant) -> list[Term]:
        """Outputs that reach the inputs of a participant."""
        return [term for wire in self._wires[participant.name] for term in wire.terms]


def is_sampled(participant: Participant) -> bool:
    """Whether it acts at instants: it has outputs, and none of them is continuous.

    What such a participant takes is what its inputs are at the start of a step.
    """
    outputs = [p for p in participant.ports.values() if p.causality is Causality.OUTPUT]
    return bool(outputs) and all(p.variability is not Variability.CONTINUOUS for p in outputs)


def _wire(
    participants: Mapping[str, Participant],
    connection: Connection,
    target: Participant,
    entry: Port,
) -> Wire:
    terms, offsets = [], []
    for end in connection.sources:
        source, output = _find(participants, connection, end, Causality.OUTPUT)
        factor, offset = _conversion(connection, end, output, entry)
        offsets.append(offset)
        continuous = output.variability is Variability.CONTINUOUS and not is_sampled(target)
        terms.append(Term(source, output.name, factor, continuous))
    if any(offsets) and len(terms) > 1:
        raise WiringError(
            f"connection {connection}: quantities in a unit with an offset cannot be added; "
            "convert them first"
        )
    return Wire(connection, tuple(terms), entry.name, sum(offsets))


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


def _conversion(connection: Connection, end: str, output: Port, entry: Port) -> tuple[float, float]:
    if output.unit is None and entry.unit is None:
        return 1.0, 0.0
    if output.unit is None or entry.unit is None:
        silent = end if output.unit is None else connection.target
        raise WiringError(
            f"connection {connection}: {silent} declares no unit, so it cannot be converted; "
            "declare one (in a pythonfmu class: units = {'delta_p': 'cmH2O'})"
        )
    try:
        return output.unit.conversion_to(entry.unit)
    except UnitError as error:
        raise WiringError(f"connection {connection}: {error}") from error
