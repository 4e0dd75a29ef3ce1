"""What can go wrong between participants."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from softbody_core.ground.errors import SimulationError as SimulationError


class CosimError(SimulationError):
    """Base of what goes wrong between participants.

    Parameters
    ----------
    message : str
        What went wrong, and what to try.
    settings : iterable of str
        Those words of the message that name what can be set: an argument or a parameter of this
        package. Who sets it by another name can put that name in their place.

    Attributes
    ----------
    settings : tuple of str
        As given.
    """

    def __init__(self, message: str, settings: Iterable[str] = ()) -> None:
        super().__init__(message)
        self.settings = tuple(settings)


class WiringError(CosimError, ValueError):
    """Two ports cannot be connected, or a port is unknown or left open."""


class SignalError(CosimError, ArithmeticError):
    """A value that is not finite crossed a connection."""


class CouplingError(CosimError, RuntimeError):
    """A coupling algorithm cannot go on, or not with these participants."""


class FmuError(CosimError, RuntimeError):
    """An FMU cannot be loaded, does not fit, or failed while it ran."""


class FmuStepError(FmuError):
    """An FMU does not take a step of this length. Another one may do."""


class FmuEndedError(FmuError):
    """An FMU asked to end the simulation."""


class FmuCrashError(FmuError):
    """The process of an FMU ended by itself."""


class FmuTimeoutError(FmuError):
    """An FMU did not answer within its time limit, and was stopped."""


class ControllerError(CosimError, ValueError):
    """A controller's source cannot be built into an FMU."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Suggest the known name that is most like `name`, and list them all."""
    names = sorted(known)
    matches = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean {matches[0]!r}? " if matches else ""
    return f"{hint}known: {', '.join(names) if names else 'none'}"
