"""An FMU in a process of its own, so that a crash or a hang in it ends the FMU and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from cosim.errors import FmuCrashError, FmuError, FmuTimeoutError
from cosim.fmu.parameters import Value
from cosim.fmu.participant import FmuParticipant
from cosim.fmu.process import FmuProcess, ProcessEnded, Request
from cosim.fmu.run_as import RunAs

TIME_LIMIT: Final = 10.0
"""For one call, s."""

_START_LIMIT: Final = 120.0
"""For the start of the process, s; it imports this package."""


def open_fmu(
    path: str | Path,
    name: str,
    parameters: Mapping[str, Value],
    *,
    run_as: RunAs | None = None,
    isolation: str = "none",
    time_limit: float = TIME_LIMIT,
) -> FmuParticipant:
    """Open an FMU in this process or, isolated, in one of its own.

    Parameters
    ----------
    path, name, parameters, run_as
        As of `FmuParticipant`.
    isolation : str
        One of `ISOLATIONS`.
    time_limit : float
        For each call into another process, s.
    """
    if ISOLATIONS[isolation] is IsolatedFmu:
        return IsolatedFmu(path, name, parameters, run_as=run_as, time_limit=time_limit)
    return FmuParticipant(path, name, parameters, run_as=run_as)


class IsolatedFmu(FmuParticipant):
    """Runs one FMU in a process of its own, with a time limit for each call.

    It gives the same values to the bit. A step costs one exchange with the process on top.

    Parameters
    ----------
    path, name, parameters, run_as
        As of `FmuParticipant`.
    time_limit : float
        Longest time that the FMU may take to answer one call, s.

    Raises
    ------
    FmuError
        As `FmuParticipant` does; also `FmuCrashError` if the process of the FMU ends, and
        `FmuTimeoutError` if it does not answer in time.
    """

    def __init__(
        self,
        path: str | Path,
        name: str = "controller",
        parameters: Mapping[str, Value] | None = None,
        *,
        run_as: RunAs | None = None,
        time_limit: float = TIME_LIMIT,
    ) -> None:
        super().__init__(path, name, parameters, run_as=run_as)
        self._opening = str(path), name, dict(parameters or {}), self.run_as
        self._time_limit = time_limit
        self._process: Any = None  # `FmuProcess` from `initialize` on
        self._written: dict[str, float] = {}

    def initialize(self, time: float) -> None:
        """Start the process, and let the FMU get ready in it."""
        if self._process is not None:
            raise FmuError(f"FMU {self.path} is already running; load it again for a second run")
        self._process = FmuProcess(self._folder.path, self.log)
        self._ask(_START_LIMIT, "start", "open", self._opening)
        self._call("be loaded and initialized", "initialize", time)

    def begin(self) -> None:
        """Leave initialization."""
        self._call("leave initialization", "begin")

    def write(self, values: Mapping[str, float]) -> None:
        """Keep the inputs; they go to the FMU with the next call."""
        self._written |= values

    def step(self, time: float, step: float) -> None:
        """Let the FMU compute one step."""
        self._call("step from t = {:.6g} s by {:.6g} s", "step", time, step)

    def get_state(self) -> Any:
        """Key of a state that the FMU keeps."""
        return self._call("save its state", "get_state")

    def set_state(self, state: Any) -> None:
        """Go back to what `get_state` gave."""
        self._call("go back to a saved state", "set_state", state)

    def free_state(self, state: Any) -> None:
        """Let the FMU forget a saved state."""
        self._call("forget a saved state", "free_state", state)

    def serialize(self) -> bytes:
        """State of the FMU as it is now, for a file."""
        data: bytes = self._call("write its state down", "serialize")
        return data

    def deserialize(self, data: bytes) -> None:
        """Go to what `serialize` gave."""
        self._call("read a state", "deserialize", data)

    def close(self) -> None:
        """End the FMU and its process, and remove its folder. May be called twice."""
        try:
            if self._process is not None and self._process.answers:
                self._call("terminate", "close")
        except FmuError as error:  # the run is over by now
            self.log.note(str(error))
        finally:
            if self._process is not None:
                self._process.close()
            super().close()

    def _call(self, what: str, method: str, *arguments: Any) -> Any:
        return self._ask(self._time_limit, what, method, arguments)

    def _ask(self, limit: float, what: str, method: str, arguments: tuple[Any, ...]) -> Any:
        """Send a request with the inputs written since the last one; `what` is for messages."""
        written, self._written = self._written, {}
        try:
            reply = self._process.ask(Request(method, arguments, written), limit)
        except ProcessEnded as end:
            action = what.format(*arguments)
            if end.late:
                raise FmuTimeoutError(
                    f"FMU {self.path} was to {action} and gave no answer within {limit:.6g} s, so "
                    "it was stopped. It hangs, or needs longer: raise time_limit. "
                    f"{self.log}",
                    settings=["time_limit"],
                ) from end
            raise FmuCrashError(
                f"FMU {self.path} crashed when it was to {action}: its process ended with "
                f"{end.reason}. The fault is in the FMU; ask who exported it. {self.log}"
            ) from end
        if reply.error is not None:
            raise reply.error
        self._values = dict(reply.outputs)
        return reply.result


ISOLATIONS: Final[dict[str, type[FmuParticipant]]] = {
    "none": FmuParticipant,
    "process": IsolatedFmu,
}
