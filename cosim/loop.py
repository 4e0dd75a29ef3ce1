"""The co-simulation loop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from cosim.algorithms import Algorithm, GaussSeidel
from cosim.connection import Connection, Wiring
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
    participants : sequence of Participant
        In the order in which Gauss-Seidel steps them. The caller closes them.
    connections : sequence of Connection
        What feeds each input.
    step : float
        Communication step, s. Point i is at ``start + i * step``, so no rounding adds up.
    steps : int
        Number of steps.
    start : float
        Time of the first point, s.
    algorithm : Algorithm, optional
        Gauss-Seidel by default.

    Yields
    ------
    CommunicationPoint
        The first one is at `start`, before any step.

    Raises
    ------
    WiringError
        If the connections do not fit.
    SignalError
        If a value that is not finite crosses a connection.
    """
    algorithm = algorithm if algorithm is not None else GaussSeidel()
    wiring = Wiring(participants, connections)
    for participant in participants:
        participant.initialize(start)
    for participant in participants:
        participant.write(wiring.inputs_of(participant))
    for participant in participants:
        participant.begin()
    yield _point(participants, 0, start)
    for index in range(1, steps + 1):
        algorithm.advance(participants, wiring, start + (index - 1) * step, step)
        yield _point(participants, index, start + index * step)


def _point(participants: Sequence[Participant], index: int, time: float) -> CommunicationPoint:
    outputs = {participant.name: dict(participant.read()) for participant in participants}
    return CommunicationPoint(index, time, outputs)
