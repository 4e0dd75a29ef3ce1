"""What a coupling algorithm is: parameters first, then bound to participants."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from cosim.connection import Wiring
from cosim.errors import CouplingError
from cosim.participant import Participant
from softbody_core.ground.parameters import Parameters


class Coupler(ABC):
    """An algorithm at work on participants. What it remembers between steps counts as state."""

    @abstractmethod
    def advance(self, time: float, step: float) -> None:
        """Carry everyone over a communication step, from `time` to `time + step`, s."""

    def get_state(self) -> Any:
        """What is remembered from one step to the next: lists, dicts, text and numbers."""
        return None

    def set_state(self, state: Any) -> None:  # noqa: B027 - nothing to set by default
        """Go back to what `get_state` gave."""

    def restart(self) -> None:  # noqa: B027 - nothing to forget by default
        """Forget what came before a jump."""


@dataclass(frozen=True)
class Algorithm(Parameters, ABC):
    """The parameters of a coupling algorithm, and what it says of itself.

    Tests hold what it says to the truth.
    """

    name: ClassVar[str]
    """In the table of algorithms, and in messages."""

    goes_back: ClassVar[bool] = False
    """Whether participants have to be put back to where a step began."""

    divides: ClassVar[bool] = False
    """Whether participants have to take parts of a communication step."""

    least_parts: ClassVar[int] = 1
    """In how many equal parts a communication step is taken at least."""

    @property
    @abstractmethod
    def order(self) -> int:
        """Power of the communication step at which the error of the coupling shrinks."""

    @property
    def in_turn(self) -> bool:
        """Whether each sees what those before it have just computed."""
        return True

    @abstractmethod
    def bind(self, participants: Sequence[Participant], wiring: Wiring) -> Coupler:
        """Get ready to carry these participants.

        Raises
        ------
        CouplingError
            If one of them cannot do what the algorithm asks of it.
        """

    def check(self, participants: Sequence[Participant]) -> None:
        """Raise `CouplingError` unless all participants can do what the algorithm needs."""
        if self.goes_back:
            require_rollback(participants, self.name)
        if self.divides:
            instead = "gauss-seidel, jacobi or iterated"
            require_variable_steps(participants, "algorithm", self.name, instead)


def require_rollback(participants: Iterable[Participant], algorithm: str) -> None:
    """Raise `CouplingError` unless all participants can be put back, for an algorithm by name."""
    fixed = [p.name for p in participants if not p.can_get_and_set_state]
    if fixed:
        raise CouplingError(
            f"algorithm {algorithm} goes back to the start of a step, and "
            f"{', '.join(fixed)} cannot save and restore its state (an FMU says so by "
            "canGetAndSetFMUstate). Take gauss-seidel or jacobi, or another controller",
            settings=["algorithm"],
        )


def require_variable_steps(
    participants: Iterable[Participant], setting: str, value: str, instead: str
) -> None:
    """Raise `CouplingError` unless all participants take steps of any length.

    Parameters
    ----------
    participants : iterable of Participant
        Those that have to.
    setting, value : str
        What divides steps, for the message.
    instead : str
        What to take instead.
    """
    fixed = [p.name for p in participants if not p.varies_step]
    if fixed:
        raise CouplingError(
            f"{setting} {value} divides steps, and {', '.join(fixed)} cannot vary its step (an FMU "
            f"says so by canHandleVariableCommunicationStepSize). Take {instead}, or another "
            "controller",
            settings=[setting],
        )
