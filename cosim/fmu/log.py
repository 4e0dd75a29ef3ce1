"""What an FMU logs: the last messages, and each warning once."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import groupby
from typing import Final

STATUS: Final = ("ok", "warning", "discard", "error", "fatal", "pending")
"""FMI's status codes, by number."""

ERROR: Final = STATUS.index("error")
FATAL: Final = STATUS.index("fatal")

_MOST: Final = 20


class FmuLog:
    """Messages of one FMU.

    Attributes
    ----------
    messages : deque of str
        The last ones, each with its status.
    warnings : list of str
        The first different ones whose status is not "ok".
    count : int
        How many there were.
    relay : callable or None
        Called with status and text of each message, too.
    """

    def __init__(self) -> None:
        self.messages: deque[str] = deque(maxlen=_MOST)
        self.warnings: list[str] = []
        self.count = 0
        self.relay: Callable[[int, bytes | None], None] | None = None

    def add(self, status: int, message: bytes | None) -> None:
        """Keep a message as FMI's logger gives it."""
        if self.relay is not None:
            self.relay(status, message)
        label = STATUS[status] if 0 <= status < len(STATUS) else str(status)
        text = (message or b"").decode("utf-8", "replace").strip()
        self.note(f"[{label}] {text}")
        if status != 0 and text not in self.warnings and len(self.warnings) < _MOST:
            self.warnings.append(text)

    def note(self, message: str) -> None:
        """Keep a message of our own."""
        self.count += 1
        self.messages.append(message)

    def __str__(self) -> str:
        """Last sentence of an error's message."""
        if not self.messages:
            return "It logged nothing."
        groups = [(message, len(list(same))) for message, same in groupby(self.messages)]
        lines = [f"  {message}" + (f" ({n} times)" if n > 1 else "") for message, n in groups]
        return "\n".join(["It logged:", *lines])
