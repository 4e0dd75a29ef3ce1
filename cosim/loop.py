"""The co-simulation loop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cosim.algorithms import Algorithm, GaussSeidel
from cosim.connection import Connection, Wiring
from cosim.errors import CouplingError
from cosim.participant import Participant


@dataclass(frozen=True)
class CommunicationPoint:
    """A moment at which all participants stand at the same time.

    Attributes
    ----------
    index : int
        0 at the start.
    time : float
        s.
    outputs : mapping
        By participant and port, in the ports' own units.
    """

    index: int
    time: float
    outputs: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class SerializedCoSimulation:
    """State of a co-simulation as it goes into a file: all that it needs to go on elsewhere.

    Attributes
    ----------
    index : int
        Of the communication point.
    participants : mapping
        What each one's `serialize` gave, by name.
    coupler : object
        State of the coupling algorithm: lists, dicts, text and numbers.
    """

    index: int
    participants: Mapping[str, bytes]
    coupler: Any


class CoSimulation:
    """Participants in step, one communication step at a call.

    Parameters
    ----------
    participants : sequence of Participant
        In the order in which Gauss-Seidel steps them. The caller closes them.
    connections : sequence of Connection
        What feeds each input.
    step : float
        Communication step, s. Point i is at ``start + i * step``, so no rounding adds up.
    start : float
        Time of the first point, s.
    algorithm : Algorithm, optional
        Gauss-Seidel by default.

    Raises
    ------
    WiringError
        If the connections do not fit.
    CouplingError
        If a participant cannot do what the algorithm asks of it.
    """

    def __init__(
        self,
        participants: Sequence[Participant],
        connections: Sequence[Connection],
        *,
        step: float,
        start: float = 0.0,
        algorithm: Algorithm | None = None,
    ) -> None:
        self._participants = participants
        self._wiring = Wiring(participants, connections)
        self._step, self._start = step, start
        algorithm = algorithm if algorithm is not None else GaussSeidel()
        self._coupler = algorithm.bind(participants, self._wiring)
        self._index = 0

    def begin(self) -> CommunicationPoint:
        """Initialize everyone, and give the first point, before any step."""
        for participant in self._participants:
            participant.initialize(self._start)
        for participant in self._participants:
            participant.write(self._wiring.inputs_of(participant))
        for participant in self._participants:
            participant.begin()
        return self._point()

    def advance(self) -> CommunicationPoint:
        """Carry everyone to the next point.

        Raises
        ------
        SignalError
            If a value that is not finite crosses a connection.
        CouplingError
            If the algorithm cannot take the step.
        """
        self._coupler.advance(self._start + self._index * self._step, self._step)
        self._index += 1
        return self._point()

    def serialize(self) -> SerializedCoSimulation:
        """State at this point, for a file.

        Raises
        ------
        CouplingError
            If a participant's state cannot be written down; see `require_serialization`.
        """
        require_serialization(self._participants)
        states = {participant.name: participant.serialize() for participant in self._participants}
        return SerializedCoSimulation(self._index, states, self._coupler.get_state())

    def deserialize(self, state: SerializedCoSimulation) -> None:
        """Go to what `serialize` gave, after `begin`. What follows repeats to the bit."""
        for participant in self._participants:
            participant.deserialize(state.participants[participant.name])
        self._coupler.set_state(state.coupler)
        self._index = state.index

    def _point(self) -> CommunicationPoint:
        outputs = {p.name: dict(p.read()) for p in self._participants}
        return CommunicationPoint(self._index, self._start + self._index * self._step, outputs)


def require_serialization(participants: Sequence[Participant]) -> None:
    """Raise `CouplingError` unless the state of each participant can be written down."""
    silent = [p.name for p in participants if not p.can_serialize_state]
    if silent:
        raise CouplingError(
            f"no checkpoint can be written: {', '.join(silent)} cannot write its state down (an "
            "FMU says so by canSerializeFMUstate). Run without checkpoints, or take another "
            "controller"
        )


def cosimulate(
    participants: Sequence[Participant],
    connections: Sequence[Connection],
    *,
    step: float,
    steps: int,
    start: float = 0.0,
    algorithm: Algorithm | None = None,
) -> Iterator[CommunicationPoint]:
    """Run participants in step, and give every communication point as it is reached.

    Parameters
    ----------
    participants, connections, step, start, algorithm
        As of `CoSimulation`.
    steps : int
        Number of steps.

    Yields
    ------
    CommunicationPoint
        The first one is at `start`, before any step.

    Raises
    ------
    WiringError, CouplingError, SignalError
        As `CoSimulation` does.
    """
    simulation = CoSimulation(
        participants, connections, step=step, start=start, algorithm=algorithm
    )
    yield simulation.begin()
    for _ in range(steps):
        yield simulation.advance()
