"""A controller written in Python, run from its script where no binary fits.

pythonfmu's binary passes each call of FMI 2.0 on to a Python object. It exists for Linux and
Windows on x86-64 only, so elsewhere the calls go to the object from here, and end as they do there.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, Final

import pythonfmu
from fmpy import fmi2
from fmpy.fmi1 import FMICallException

from cosim.errors import ControllerError
from cosim.fmu.calls import Calls, LoadingError, ShortStep
from cosim.fmu.log import FATAL, FmuLog
from cosim.fmu.script_errors import described

SCRIPT_NAME: Final = "slavemodule.txt"
"""File of a Python FMU's resources that names its script."""

_TYPES: Final = {"Real": float, "Integer": int, "Boolean": bool, "String": str}


def slave_class(module: ModuleType, base: type) -> type:
    """Class of a script that is an FMU: of those that derive from `base`, the last one derived.

    Raises
    ------
    ControllerError
        If there is none.
    """
    classes = [
        item
        for item in vars(module).values()
        if isinstance(item, type) and issubclass(item, base) and item.__module__ == module.__name__
    ]
    if not classes:
        raise ControllerError(f"it has no class that derives from {base.__name__}")
    return max(classes, key=lambda item: len(item.__mro__))


class PythonSlave:
    """The object behind a Python FMU, with the methods of fmpy's ``FMU2Slave`` that are in use.

    An exception of the script is logged and ends the call as fatal, as in pythonfmu's binary.

    Parameters
    ----------
    resources : Path
        Folder with the script.
    name : str
        Name of the instance.
    log : FmuLog
        Takes what the script logs.

    Raises
    ------
    LoadingError
        If the script cannot be imported, or has no class that is an FMU.
    """

    def __init__(self, resources: Path, name: str, log: FmuLog) -> None:
        self._resources, self._name, self._log = resources, name, log
        script = (resources / SCRIPT_NAME).read_text(encoding="utf-8").strip()
        sys.path.insert(0, str(resources))  # and `imports_undone` takes it out again
        importlib.invalidate_caches()  # it is younger than what Python remembers of it
        try:
            self._class = slave_class(importlib.import_module(script), pythonfmu.Fmi2Slave)
        except Exception as error:  # whatever the script raises
            raise LoadingError(f"its script fails: {described(error, self._resources)}") from error
        self._slave: Any = None

    def instantiate(self) -> None:
        """Make the object."""
        try:
            self._slave = self._class(
                instance_name=self._name, resources=str(self._resources), visible=False
            )
        except Exception as error:  # whatever the script raises
            raise LoadingError(f"its script fails: {described(error, self._resources)}") from error
        self._pass_on_log()

    def setupExperiment(self, startTime: float) -> None:  # noqa: N802, N803 - fmpy's names
        self._call("SetupExperiment", self._slave.setup_experiment, startTime, None, None)

    def enterInitializationMode(self) -> None:  # noqa: N802
        self._call("EnterInitializationMode", self._slave.enter_initialization_mode)

    def exitInitializationMode(self) -> None:  # noqa: N802
        self._call("ExitInitializationMode", self._slave.exit_initialization_mode)

    def do_step(self, time: float, step: float) -> bool:
        """Step; False if the script asks to end the simulation."""
        return bool(self._call("DoStep", self._slave.do_step, time, step))

    def get(self, kind: str, references: Sequence[int]) -> list[Any]:
        """Values of variables of one type."""
        getter = getattr(self._slave, f"get_{kind.lower()}")
        values: list[Any] = self._call(f"Get{kind}", getter, references)
        return values

    def set(self, kind: str, references: Sequence[int], values: Sequence[Any]) -> None:
        """Set variables of one type."""
        setter = getattr(self._slave, f"set_{kind.lower()}")
        self._call(f"Set{kind}", setter, references, list(map(_TYPES[kind], values)))

    def getFMUState(self) -> Any:  # noqa: N802
        return self._call("GetFMUstate", self._slave._get_fmu_state)  # noqa: SLF001

    def setFMUState(self, state: Any) -> None:  # noqa: N802
        self._call("SetFMUstate", self._slave._set_fmu_state, state)  # noqa: SLF001

    def freeFMUState(self, state: Any) -> None:  # noqa: N802
        """Nothing to let go of."""

    def serializeFMUState(self, state: Any) -> bytes:  # noqa: N802
        write = self._class._fmu_state_to_bytes  # type: ignore[attr-defined]  # noqa: SLF001
        data: bytes = self._call("SerializeFMUstate", write, state)
        return data

    def deserializeFMUState(self, data: bytes) -> Any:  # noqa: N802
        read = self._class._fmu_state_from_bytes  # type: ignore[attr-defined]  # noqa: SLF001
        return self._call("DeSerializeFMUstate", read, data)

    def terminate(self) -> None:
        self._call("Terminate", self._slave.terminate)

    def freeInstance(self) -> None:  # noqa: N802
        self._slave = None

    def _call(self, function: str, method: Callable[..., Any], *arguments: Any) -> Any:
        try:
            answer = method(*arguments)
        except Exception as error:  # whatever the script raises
            self._pass_on_log()
            self._log.add(FATAL, described(error, self._resources).encode())
            raise FMICallException(f"fmi2{function}", FATAL) from error
        self._pass_on_log()
        return answer

    def _pass_on_log(self) -> None:
        queue = self._slave._get_log_queue()  # noqa: SLF001 - as pythonfmu's binary does
        for message in queue:
            self._log.add(message.status.value, str(message.msg).encode())
        queue.clear()


class Fmi2Python(Calls):
    """FMI 2.0 without a binary."""

    types = fmi2

    def _slave(self, arguments: dict[str, Any]) -> PythonSlave:
        resources = Path(arguments["unzipDirectory"]) / "resources"
        return PythonSlave(resources, arguments["instanceName"], self._log)

    def instantiate(self) -> None:
        self.fmu.instantiate()

    def do_step(self, time: float, step: float, final: bool) -> ShortStep | None:
        if self.fmu.do_step(time, step):
            return None
        return ShortStep(time, ended=True, refused=True)

    def exchange(
        self, kind: str, references: Sequence[int], count: int
    ) -> tuple[Callable[[], Sequence[Any]], Callable[[Sequence[Any]], None]]:
        return (
            lambda: self.fmu.get(kind, references),
            lambda values: self.fmu.set(kind, references, values),
        )

    def assign(self, kind: str, reference: int, values: Sequence[Any]) -> None:
        self.fmu.set(kind, [reference], values)
