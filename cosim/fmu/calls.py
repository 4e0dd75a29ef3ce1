"""What every version of FMI is asked to do, and how a step may end."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any, ClassVar

from fmpy.model_description import ModelVariable

from cosim.fmu.log import FmuLog


class LoadingError(RuntimeError):
    """Why an FMU does not load, and what to try."""


@dataclass(frozen=True)
class ShortStep:
    """How a step ended that did not come to its end.

    Attributes
    ----------
    reached : float or None
        Time up to which the FMU came, s, if it tells.
    ended : bool
        It asks to end the simulation.
    refused : bool
        It refused the step; otherwise it can go on from where it came to.
    """

    reached: float | None
    ended: bool
    refused: bool


class Calls(ABC):
    """One FMU, through one version of FMI.

    Parameters
    ----------
    arguments : mapping
        What fmpy's classes take: guid, modelIdentifier, unzipDirectory, instanceName.
    log : FmuLog
        Takes what it logs.

    Attributes
    ----------
    fmu : FMU1Slave, FMU2Slave or FMU3Slave
        The FMU, its library loaded.
    """

    types: ClassVar[ModuleType]
    """fmpy's module of the version."""

    enumeration: ClassVar[str] = "Integer"
    """Name of the type that enumerations are."""

    initializes: ClassVar[bool] = True
    """Whether outputs can be read before initialization is left."""

    counts_values: ClassVar[bool] = False
    """Whether getters and setters take the number of values, for arrays."""

    def __init__(self, arguments: dict[str, Any], log: FmuLog) -> None:
        self._log = log
        self.fmu = self._slave(arguments)

    @property
    def prefix(self) -> str:
        """What names of functions and types begin with."""
        return self.types.__name__.rpartition(".")[2]

    def kind(self, variable: ModelVariable) -> str:
        """Type of a variable in the names of getters and setters."""
        return self.enumeration if variable.type == "Enumeration" else str(variable.type)

    def exchange(
        self, kind: str, references: Sequence[int], count: int
    ) -> tuple[Callable[[], Sequence[Any]], Callable[[Sequence[Any]], None]]:
        """Functions that get and set `count` values of variables of one type, through one array."""
        keys = (getattr(self.types, f"{self.prefix}ValueReference") * len(references))(*references)
        array = (self.c_type(kind) * count)()
        arguments = [self.fmu.component, keys, len(references), array]
        if self.counts_values:
            arguments.append(count)
        read = partial(getattr(self.fmu, f"{self.prefix}Get{kind}"), *arguments)
        write = partial(getattr(self.fmu, f"{self.prefix}Set{kind}"), *arguments)

        def get() -> Sequence[Any]:
            read()
            values: Sequence[Any] = array[:]
            return values

        def set_(given: Sequence[Any]) -> None:
            array[:] = given
            write()

        return get, set_

    def assign(self, kind: str, reference: int, values: Sequence[Any]) -> None:
        """Set one variable, of any type, texts too."""
        getattr(self.fmu, f"set{kind}")([reference], values)

    def c_type(self, kind: str) -> Any:
        """C's type of a value."""
        return getattr(self.types, f"{self.prefix}{kind}")

    @abstractmethod
    def _slave(self, arguments: dict[str, Any]) -> Any: ...

    @abstractmethod
    def instantiate(self) -> None:
        """Make the instance."""

    def enter_initialization(self, time: float) -> None:
        """Get ready to start at `time`, s."""
        self.fmu.setupExperiment(startTime=time)
        self.fmu.enterInitializationMode()

    def leave_initialization(self) -> None:
        """Start."""
        self.fmu.exitInitializationMode()

    @abstractmethod
    def do_step(self, time: float, step: float, final: bool) -> ShortStep | None:
        """Step; None if that came to its end. If `final`, no state before `time` comes back."""
