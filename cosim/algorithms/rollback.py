"""All participants, back to where they were."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.errors import CouplingError
from cosim.participant import Participant


class Rollback:
    """State of participants now, to go back to as often as need be.

    After an error in a participant it is let go of as it is: FMI then allows no further call.

    Parameters
    ----------
    participants : sequence of Participant
        Each of which can save.
    """

    def __init__(self, participants: Sequence[Participant]) -> None:
        self._saved = [(participant, participant.save()) for participant in participants]

    def restore(self) -> None:
        """Put everyone back."""
        for participant, saved in self._saved:
            participant.restore(saved)

    def release(self) -> None:
        """Let everyone forget the state."""
        for participant, saved in self._saved:
            participant.release(saved)


def can_roll_back(participants: Sequence[Participant]) -> bool:
    """Whether all of them can."""
    return all(participant.can_save for participant in participants)


def require_rollback(participants: Sequence[Participant], algorithm: str) -> None:
    """Raise `CouplingError` unless all participants can be put back.

    Parameters
    ----------
    participants : sequence of Participant
        Those that have to.
    algorithm : str
        Who asks, for the message.
    """
    fixed = [participant.name for participant in participants if not participant.can_save]
    if fixed:
        raise CouplingError(
            f"coupling.algorithm {algorithm} goes back to the start of a step, and "
            f"{', '.join(fixed)} cannot save and restore its state (an FMU says so by "
            "canGetAndSetFMUstate). Take gauss-seidel or jacobi, or another controller"
        )
