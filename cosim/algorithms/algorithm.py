"""What a coupling algorithm is: parameters first, then bound to participants."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Protocol

from cosim.connection import Wiring
from cosim.participant import Participant


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


class Algorithm(Protocol):
    """The parameters of a coupling algorithm."""

    @property
    def order(self) -> int:
        """Power of the communication step at which the error of the coupling shrinks."""
        ...

    def bind(self, participants: Sequence[Participant], wiring: Wiring) -> Coupler:
        """Get ready to carry these participants.

        Raises
        ------
        CouplingError
            If one of them cannot do what the algorithm asks of it.
        """
        ...
