"""An FMU as a participant: FMI 2.0 and 3.0 co-simulation through fmpy."""

from __future__ import annotations

import ctypes
import hashlib
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Final

import fmpy
import pythonfmu  # noqa: F401 - Python FMUs find this one, and not the copy in a folder that goes
from fmpy import fmi2, fmi3
from fmpy.logging import addLoggerProxy

from cosim.errors import FmuError
from cosim.fmu_description import ports_of, read_description
from cosim.fmu_folder import FmuFolder
from cosim.fmu_parameters import Value, checked_parameters
from cosim.fmu_variables import FmuVariables, by_type, set_one
from cosim.participant import Causality, Port

_STATUS: Final = ("ok", "warning", "discard", "error", "fatal", "pending")
_FATAL: Final = 4
_KEPT_MESSAGES: Final = 20


class FmuParticipant:
    """Runs one FMU in this process.

    Parameters
    ----------
    path : str or Path
        The FMU.
    name : str
        Name of the participant.
    parameters : mapping, optional
        FMU parameters by name. One with a unit takes text such as ``"1.25 L"``, which is converted.

    Attributes
    ----------
    ports : mapping
        Its scalar numeric inputs and outputs, in the FMU's own units.
    sha256 : str
        Hash of the file.
    messages : sequence of str
        The last messages that the FMU logged.

    Raises
    ------
    FmuError
        If the FMU cannot be loaded, or a parameter does not fit.
    """

    def __init__(
        self,
        path: str | Path,
        name: str = "controller",
        parameters: Mapping[str, Value] | None = None,
    ) -> None:
        self.path = Path(path)
        self.name = name
        self.messages: deque[str] = deque(maxlen=_KEPT_MESSAGES)
        self._folder = FmuFolder(self.path)
        self._fmu: Any = None
        self._started = False
        self._dead = False
        self._callbacks: Any = None  # kept, or the garbage collector takes what the FMU calls
        try:
            self.sha256 = hashlib.sha256(self.path.read_bytes()).hexdigest()
            self._description = read_description(self.path, self._folder)
            self.ports: Mapping[str, Port] = ports_of(self.path, self._description)
            self._variables = {v.name: v for v in self._description.modelVariables}
            self._parameters = checked_parameters(self.path, self._description, parameters or {})
        except BaseException:
            self._folder.close()
            raise
        self._fmi3 = self._description.fmiVersion.startswith("3.")
        self._inputs: dict[tuple[str, ...], list[FmuVariables]] = {}
        self._outputs: list[FmuVariables] = []
        self._values: dict[str, float] = {}

    def initialize(self, time: float) -> None:
        """Load and instantiate the FMU, set its parameters, and enter initialization."""
        if self._started:
            raise FmuError(f"FMU {self.path} is already running; load it again for a second run")
        self._started = True
        with self._folder.own_imports():
            self._call("be loaded", self._load)
        given = (name for name, p in self.ports.items() if p.causality is Causality.OUTPUT)
        self._outputs = self._by_type(given)
        for name, value in self._parameters.items():
            self._call("take {1.name} = {2!r}", set_one, self._fmu, self._variables[name], value)
        if self._fmi3:
            self._call("enter initialization", self._fmu.enterInitializationMode, startTime=time)
        else:
            self._call("set up the experiment", self._fmu.setupExperiment, startTime=time)
            self._call("enter initialization", self._fmu.enterInitializationMode)
        self._read_outputs()

    def begin(self) -> None:
        """Leave initialization."""
        self._call("leave initialization", self._fmu.exitInitializationMode)
        self._read_outputs()

    def write(self, values: Mapping[str, float]) -> None:
        """Set inputs, in the FMU's own units."""
        names = tuple(values)
        if names not in self._inputs:
            self._inputs[names] = self._by_type(names)
        for variables in self._inputs[names]:
            self._call("take {}", variables.write, values)

    def step(self, time: float, step: float) -> None:
        """Let the FMU compute one step."""
        result = self._call("step from t = {:.6g} s", self._fmu.doStep, time, step)
        if self._fmi3 and result[1]:
            raise FmuError(
                f"FMU {self.path} asked to end the simulation at t = {time + step:.6g} s"
            )
        self._read_outputs()

    def read(self) -> Mapping[str, float]:
        """Outputs after the last call, in the FMU's own units."""
        return self._values

    def close(self) -> None:
        """End the FMU and remove its folder. May be called twice.

        After a fatal error an FMU stays loaded and is not called again: FMI forbids it, and a
        Python FMU, which has let go of its objects by then, would let go of them once more.
        """
        fmu, self._fmu = self._fmu, None
        self._inputs, self._outputs = {}, []
        try:
            if fmu is not None and fmu.component and not self._dead:
                self._call("terminate", fmu.terminate)
        except FmuError as error:  # an FMU that failed refuses to terminate; that is no news
            self.messages.append(str(error))
        finally:
            if fmu is not None and fmu.component and not self._dead:
                fmu.freeInstance()
            self._folder.close()

    def _load(self) -> None:
        arguments = {
            "guid": self._description.instantiationToken,
            "unzipDirectory": str(self._folder.path),
            "modelIdentifier": self._description.coSimulation.modelIdentifier,
            "instanceName": self.name,
        }
        if self._fmi3:
            self._fmu = fmi3.FMU3Slave(**arguments)
            self._fmu.instantiate(loggingOn=True, logMessage=self._log3)
            return
        self._fmu = fmi2.FMU2Slave(**arguments)
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._log2)
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
        addLoggerProxy(ctypes.byref(callbacks))
        self._callbacks = callbacks
        self._fmu.instantiate(callbacks=callbacks, loggingOn=True)

    def _log2(self, _: Any, __: bytes, status: int, ___: bytes, message: bytes) -> None:
        self._log(status, message)

    def _log3(self, _: Any, status: int, __: bytes, message: bytes) -> None:
        self._log(status, message)

    def _log(self, status: int, message: bytes | None) -> None:
        label = _STATUS[status] if 0 <= status < len(_STATUS) else str(status)
        self.messages.append(f"[{label}] {(message or b'').decode('utf-8', 'replace').strip()}")

    def _call(self, what: str, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        """Call into the FMU; a failure becomes an `FmuError` with what the FMU logged.

        `what` is formatted with the arguments, but only then: it would take longer than the call.
        """
        try:
            return function(*args, **kwargs)
        except Exception as error:  # fmpy raises bare Exception and its own, unrelated classes
            self._dead = self._dead or getattr(error, "status", None) == _FATAL
            logged = "\n".join(f"  {message}" for message in self.messages)
            said = f"; it logged:\n{logged}" if logged else "; it logged nothing"
            raise FmuError(
                f"FMU {self.path} could not {what.format(*args)}: {str(error).rstrip('.')}{said}"
            ) from error

    def _read_outputs(self) -> None:
        values: dict[str, float] = {}
        for variables in self._outputs:
            values |= self._call("be read", variables.read)
        self._values = values

    def _by_type(self, names: Iterable[str]) -> list[FmuVariables]:
        return by_type(self._fmu, [self._variables[name] for name in names])
