"""Coupling algorithms: who steps when, and with which inputs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Protocol

from cosim.connection import Wiring
from cosim.participant import Participant


class Algorithm(Protocol):
    """Carries all participants over one communication step."""

    def advance(
        self, participants: Sequence[Participant], wiring: Wiring, time: float, step: float
    ) -> None:
        """Move everyone from `time` to `time + step`, s."""
        ...


class GaussSeidel:
    """One after the other, in the order given: each sees what those before it have just computed.

    With the controller first, a body feels the controller's answer to the volume that it has now.
    """

    def advance(
        self, participants: Sequence[Participant], wiring: Wiring, time: float, step: float
    ) -> None:
        """Move everyone from `time` to `time + step`, s."""
        for participant in participants:
            participant.write(wiring.inputs_of(participant))
            participant.step(time, step)


class Jacobi:
    """All at once: everyone sees what the others gave at the start of the step.

    The order does not matter, and every connection lags by one communication step.
    """

    def advance(
        self, participants: Sequence[Participant], wiring: Wiring, time: float, step: float
    ) -> None:
        """Move everyone from `time` to `time + step`, s."""
        inputs = [wiring.inputs_of(participant) for participant in participants]
        for participant, values in zip(participants, inputs, strict=True):
            participant.write(values)
            participant.step(time, step)


ALGORITHMS: Final[dict[str, type[Algorithm]]] = {
    "gauss-seidel": GaussSeidel,
    "jacobi": Jacobi,
}
