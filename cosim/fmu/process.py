"""A process that runs one FMU for another, and a watch over how long it takes."""

from __future__ import annotations

import math
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import IO, Any, Final, NamedTuple, cast

from cosim.fmu.log import FmuLog

_GLANCE: Final = 0.05
"""How often the watch looks at the clock, s."""

_PATIENCE: Final = 2.0
"""How long a process may take to leave when all is done, s."""


class Request(NamedTuple):
    """A method of the FMU's to call, and inputs to write before."""

    method: str
    arguments: tuple[Any, ...]
    inputs: Mapping[str, float]


class Logged(NamedTuple):
    """A message that the FMU logs; it comes before the reply, or before the process ends."""

    status: int
    message: bytes | None


class Reply(NamedTuple):
    """What came of a request."""

    result: Any
    error: Exception | None
    outputs: Mapping[str, float]


class ProcessEnded(Exception):
    """The process gave no answer.

    Attributes
    ----------
    late : bool
        It was stopped because its time was up.
    reason : str
        How it ended otherwise.
    """

    def __init__(self, late: bool, reason: str) -> None:
        super().__init__(late, reason)
        self.late = late
        self.reason = reason


class FmuProcess:
    """Asks ``cosim.fmu.worker`` in a process of its own, one request at a time.

    The process has its own session, so that Ctrl-C reaches only this one, and it leaves when this
    one is gone, however that came.

    Parameters
    ----------
    folder : Path
        For its temporary files.
    log : FmuLog
        Takes what the FMU logs.
    """

    def __init__(self, folder: Path, log: FmuLog) -> None:
        self._log = log
        temporary = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder))
        path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "cosim.fmu.worker", str(os.getpid())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **temporary, "PYTHONPATH": path},
            start_new_session=True,
        )
        self._requests = cast("IO[bytes]", self._process.stdin)
        self._replies = cast("IO[bytes]", self._process.stdout)
        self._waiting = self._late = False
        self._deadline = math.inf
        self._closed = threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()

    def ask(self, request: Request, limit: float) -> Reply:
        """Send a request and wait for the reply, no longer than `limit` seconds.

        Raises
        ------
        ProcessEnded
            If there is none.
        """
        self._waiting = True  # and stays so if the wait is interrupted
        self._deadline = monotonic() + limit
        try:
            pickle.dump(request, self._requests)
            self._requests.flush()
            while isinstance(answer := self._next(), Logged):
                self._log.add(answer.status, answer.message)
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            self._process.wait()
            raise ProcessEnded(self._late, _ending(self._process.returncode)) from error
        finally:
            self._deadline = math.inf
        self._waiting = False
        return answer

    @property
    def answers(self) -> bool:
        """Whether another request makes sense."""
        return not self._waiting and self._process.poll() is None

    def close(self) -> None:
        """End the process."""
        self._closed.set()
        with suppress(OSError, subprocess.TimeoutExpired):
            self._requests.close()  # on which it leaves
            if not self._waiting:
                self._process.wait(_PATIENCE)
        self._kill()
        self._process.wait()
        self._replies.close()

    def _next(self) -> Logged | Reply:
        answer: Logged | Reply = pickle.load(self._replies)  # noqa: S301 - a process of our own
        return answer

    def _watch(self) -> None:
        while not self._closed.wait(_GLANCE):
            if monotonic() > self._deadline:
                self._late = True
                self._kill()
                return

    def _kill(self) -> None:
        """End the process and what it started."""
        if self._process.poll() is not None:
            return
        if sys.platform == "win32":
            self._process.kill()
            return
        with suppress(ProcessLookupError):  # it may leave between the two lines
            os.killpg(self._process.pid, signal.SIGKILL)


def _ending(code: int) -> str:
    if code >= 0:
        return f"exit code {code}"
    return f"{signal.Signals(-code).name} ({(signal.strsignal(-code) or 'signal').lower()})"
