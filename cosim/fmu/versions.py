"""The calls in which FMI 1.0, 2.0 and 3.0 differ, and the table of them."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, Final

from fmpy import fmi1, fmi2, fmi3

from cosim.fmu.calls import Calls, ShortStep
from cosim.fmu.log import FmuLog
from cosim.fmu.logger import callbacks1, callbacks2

_DISCARD: Final = 2


class Fmi2(Calls):
    """FMI 2.0."""

    types = fmi2

    def _slave(self, arguments: dict[str, Any]) -> Any:
        return fmi2.FMU2Slave(**arguments)

    def instantiate(self) -> None:
        self.fmu.instantiate(callbacks=callbacks2(), loggingOn=True)

    def do_step(self, time: float, step: float, final: bool) -> ShortStep | None:
        try:
            self.fmu.fmi2DoStep(self.fmu.component, time, step, final)
        except fmi1.FMICallException as error:
            if error.status != _DISCARD:
                raise
            ended = _answer(lambda: self.fmu.getBooleanStatus(fmi2.fmi2Terminated))
            reached = _answer(lambda: self.fmu.getRealStatus(fmi2.fmi2LastSuccessfulTime))
            return ShortStep(reached, bool(ended), refused=True)
        return None


class Fmi1(Calls):
    """FMI 1.0, which has no mode of initialization: all of it is one call."""

    types = fmi1
    initializes = False

    def _slave(self, arguments: dict[str, Any]) -> Any:
        fmu = fmi1.FMU1Slave(**arguments)
        for name in ("InitializeSlave", "DoStep", "GetRealStatus"):
            # fmpy takes their status for a text, and would read at that address.
            getattr(fmu.dll, f"{fmu.modelIdentifier}_fmi{name}").restype = ctypes.c_int
        return fmu

    def instantiate(self) -> None:
        self.fmu.instantiate(functions=callbacks1(), loggingOn=True)
        if not self.fmu.component:
            raise RuntimeError("Failed to instantiate model")

    def enter_initialization(self, time: float) -> None:
        self._start = time

    def leave_initialization(self) -> None:
        self.fmu.initialize(tStart=self._start)

    def do_step(self, time: float, step: float, final: bool) -> ShortStep | None:
        try:
            self.fmu.doStep(time, step)
        except fmi1.FMICallException as error:
            if error.status != _DISCARD:
                raise
            reached = _answer(lambda: self.fmu.getRealStatus(fmi1.fmi1LastSuccessfulTime).value)
            return ShortStep(reached, ended=False, refused=True)
        return None


class Fmi3(Calls):
    """FMI 3.0."""

    types = fmi3
    enumeration = "Int64"
    counts_values = True

    def __init__(self, arguments: dict[str, Any], log: FmuLog) -> None:
        super().__init__(arguments, log)
        self._event, self._end, self._early = (fmi3.fmi3Boolean() for _ in range(3))
        self._reached = fmi3.fmi3Float64()
        self._answers = [
            ctypes.byref(x) for x in (self._event, self._end, self._early, self._reached)
        ]

    def _slave(self, arguments: dict[str, Any]) -> Any:
        return fmi3.FMU3Slave(**arguments)

    def instantiate(self) -> None:
        def log(_: Any, status: int, __: bytes, message: bytes) -> None:
            self._log.add(status, message)

        self.fmu.instantiate(loggingOn=True, logMessage=log)

    def enter_initialization(self, time: float) -> None:
        self.fmu.enterInitializationMode(startTime=time)

    def do_step(self, time: float, step: float, final: bool) -> ShortStep | None:
        self._end.value = self._early.value = False
        self._reached.value = time
        try:
            self.fmu.fmi3DoStep(self.fmu.component, time, step, final, *self._answers)
        except fmi1.FMICallException as error:
            if error.status != _DISCARD:
                raise
            return ShortStep(self._reached.value, self._end.value, refused=True)
        if self._end.value or self._early.value:
            return ShortStep(self._reached.value, self._end.value, refused=False)
        return None


VERSIONS: Final[dict[str, type[Calls]]] = {"1": Fmi1, "2": Fmi2, "3": Fmi3}
"""By the first number of the version."""


def _answer(ask: Callable[[], Any]) -> Any:
    """Answer to a question that an FMU need not answer; None then."""
    try:
        return ask()
    except fmi1.FMICallException:
        return None
