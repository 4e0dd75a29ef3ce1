"""All participants, back to where they were."""

from __future__ import annotations

from collections.abc import Sequence

from cosim.participant import Participant


class Rollback:
    """States of participants now, to go back to as often as need be.

    After an error in a participant its state is left as it is: FMI then allows no further call.

    Parameters
    ----------
    participants : sequence of Participant
        Each of which can get and set its state.
    """

    def __init__(self, participants: Sequence[Participant]) -> None:
        self._states = [(participant, participant.get_state()) for participant in participants]

    def set_states(self) -> None:
        """Put everyone back."""
        for participant, state in self._states:
            participant.set_state(state)

    def free_states(self) -> None:
        """Let everyone forget its state."""
        for participant, state in self._states:
            participant.free_state(state)


def can_roll_back(participants: Sequence[Participant]) -> bool:
    """Whether all of them can."""
    return all(participant.can_get_and_set_state for participant in participants)
