"""Calls into an FMU, whose failures become errors that say what was asked and what it logged."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fmpy.fmi1 import FMICallException

from cosim.errors import FmuError
from cosim.fmu.log import STATUS, FmuLog


class Guard:
    """Calls functions of one FMU.

    Parameters
    ----------
    path : Path
        The FMU, for messages.
    log : FmuLog
        What it logs.

    Attributes
    ----------
    path, log
        As given.
    worst : int
        The worst status that the FMU has answered with.
    """

    def __init__(self, path: Path, log: FmuLog) -> None:
        self.path = path
        self.log = log
        self.worst = 0

    def call(self, what: str, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        """Call a function; `what` says what the FMU is to do, and is formatted with `args`.

        It is formatted only after a failure: that would take longer than the call.

        Raises
        ------
        FmuError
            If the call fails.
        """
        try:
            return function(*args, **kwargs)
        except Exception as error:  # fmpy raises bare Exception and its own, unrelated classes
            self.worst = max(self.worst, getattr(error, "status", 0))
            raise FmuError(
                f"FMU {self.path} could not {what.format(*args)}: {_reason(error)}. {self.log}"
            ) from error


def _reason(error: Exception) -> str:
    if isinstance(error, FMICallException) and error.status in range(len(STATUS)):
        return f"{error.function} answered with status {error.status} ({STATUS[error.status]})"
    return str(error).rstrip(".")
