"""Steps that are divided, and who can take the parts."""

from __future__ import annotations

from collections.abc import Iterable

from cosim.errors import CouplingError
from cosim.participant import Participant


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
    fixed = [participant.name for participant in participants if not participant.varies_step]
    if fixed:
        raise CouplingError(
            f"{setting} {value} divides steps, and {', '.join(fixed)} cannot vary its step (an FMU "
            f"says so by canHandleVariableCommunicationStepSize). Take {instead}, or another "
            "controller",
            settings=[setting],
        )
