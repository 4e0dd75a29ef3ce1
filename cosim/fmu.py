"""An FMU as a participant: FMI 2.0 and 3.0 co-simulation through fmpy."""

from __future__ import annotations

import ctypes
import hashlib
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import fmpy
import pythonfmu  # noqa: F401 - Python FMUs find this one, and not the copy in a folder that goes
from fmpy import fmi2, fmi3
from fmpy.logging import addLoggerProxy
from fmpy.model_description import ModelVariable

from cosim.errors import FmuError, nearest
from cosim.fmu_description import declared_units, ports_of, read_description, unit_of
from cosim.fmu_folder import FmuFolder
from cosim.participant import Causality, Port
from cosim.units import UnitError, quantity

Value = float | int | bool | str

_STATUS: Final = ("ok", "warning", "discard", "error", "fatal", "pending")
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
        self._callbacks: Any = None  # kept, or the garbage collector takes what the FMU calls
        try:
            self.sha256 = hashlib.sha256(self.path.read_bytes()).hexdigest()
            self._description = read_description(self.path, self._folder)
            self.ports: Mapping[str, Port] = ports_of(self.path, self._description)
            self._variables = {v.name: v for v in self._description.modelVariables}
            self._parameters = self._checked(parameters or {})
        except BaseException:
            self._folder.close()
            raise
        self._fmi3 = self._description.fmiVersion.startswith("3.")
        self._outputs = self._by_type(Causality.OUTPUT)
        self._values: dict[str, float] = {}

    def initialize(self, time: float) -> None:
        """Load and instantiate the FMU, set its parameters, and enter initialization."""
        if self._started:
            raise FmuError(f"FMU {self.path} is already running; load it again for a second run")
        self._started = True
        with self._folder.own_imports():
            self._call("be loaded", self._load)
        for name, value in self._parameters.items():
            self._call(f"take {name} = {value!r}", self._set, self._variables[name], value)
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
        for name, value in values.items():
            self._call(f"take {name} = {value!r}", self._set, self._variables[name], value)

    def step(self, time: float, step: float) -> None:
        """Let the FMU compute one step."""
        result = self._call(f"step from t = {time:.6g} s", self._fmu.doStep, time, step)
        if self._fmi3 and result[1]:
            raise FmuError(
                f"FMU {self.path} asked to end the simulation at t = {time + step:.6g} s"
            )
        self._read_outputs()

    def read(self) -> Mapping[str, float]:
        """Outputs after the last call, in the FMU's own units."""
        return self._values

    def close(self) -> None:
        """End the FMU and remove its folder. May be called twice."""
        fmu, self._fmu = self._fmu, None
        try:
            if fmu is not None and fmu.component:
                fmu.terminate()
        except Exception as error:  # an FMU that failed refuses to terminate; that is no news
            self.messages.append(f"terminate: {error}")
        finally:
            if fmu is not None and fmu.component:
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
        """Call into the FMU; a failure becomes an `FmuError` with what the FMU logged."""
        try:
            return function(*args, **kwargs)
        except Exception as error:  # fmpy raises bare Exception and its own, unrelated classes
            logged = "\n".join(f"  {message}" for message in self.messages)
            said = f"; it logged:\n{logged}" if logged else "; it logged nothing"
            raise FmuError(f"FMU {self.path} could not {what}: {error}{said}") from error

    def _set(self, variable: ModelVariable, value: Value) -> None:
        setter = getattr(self._fmu, f"set{_accessor(variable)}")
        setter([variable.valueReference], [_python_type(variable)(value)])

    def _read_outputs(self) -> None:
        values: dict[str, float] = {}
        for accessor, (names, references) in self._outputs.items():
            getter = getattr(self._fmu, f"get{accessor}")
            values.update(
                zip(names, map(float, self._call("be read", getter, references)), strict=True)
            )
        self._values = values

    def _by_type(self, causality: Causality) -> dict[str, tuple[list[str], list[int]]]:
        groups: dict[str, tuple[list[str], list[int]]] = {}
        for port in self.ports.values():
            if port.causality is causality:
                variable = self._variables[port.name]
                names, references = groups.setdefault(_accessor(variable), ([], []))
                names.append(port.name)
                references.append(variable.valueReference)
        return groups

    def _checked(self, parameters: Mapping[str, Value]) -> dict[str, Value]:
        """Parameters in the FMU's units; raise for an unknown one or a value out of bounds."""
        known = {
            name: variable
            for name, variable in self._variables.items()
            if variable.causality in ("parameter", "structuralParameter")
        }
        units = declared_units(self.path, self._description)
        checked: dict[str, Value] = {}
        for name, value in parameters.items():
            if name not in known:
                raise FmuError(f"FMU {self.path} has no parameter {name!r}; {nearest(name, known)}")
            variable = known[name]
            own = unit_of(self.path, variable, units)
            if _python_type(variable) is str:
                checked[name] = str(value)
                continue
            if own is not None and own.symbol != "1":
                value = _quantity(name, value, own.symbol)
            try:
                number = _python_type(variable)(value)
            except ValueError as error:
                raise FmuError(f"parameter {name} = {value!r}: expected {variable.type}") from error
            lowest, highest = (
                None if bound is None else float(bound) for bound in (variable.min, variable.max)
            )
            if lowest is not None and float(number) < lowest:
                raise FmuError(f"parameter {name} = {value}: expected at least {lowest:g}")
            if highest is not None and float(number) > highest:
                raise FmuError(f"parameter {name} = {value}: expected at most {highest:g}")
            checked[name] = number
        return checked


def _quantity(name: str, value: Value, symbol: str) -> float:
    if not isinstance(value, str):
        raise FmuError(
            f"parameter {name} = {value!r} has no unit; write it like '{value} {symbol}'"
        )
    try:
        return quantity(value, symbol)
    except UnitError as error:
        raise FmuError(f"parameter {name}: {error}") from error


def _accessor(variable: ModelVariable) -> str:
    return "Integer" if variable.type == "Enumeration" else str(variable.type)


def _python_type(variable: ModelVariable) -> type[float] | type[int] | type[bool] | type[str]:
    if variable.type in ("Real", "Float64", "Float32"):
        return float
    if variable.type == "Boolean":
        return bool
    return str if variable.type == "String" else int
