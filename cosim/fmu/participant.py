"""An FMU as a participant: co-simulation of FMI 1.0, 2.0 and 3.0 through fmpy."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pythonfmu  # noqa: F401 - Python FMUs find this one, and not the copy in a folder that goes

from cosim.errors import FmuError
from cosim.fmu.description import elements, ports_of, read_description
from cosim.fmu.exception_types import keep_exception_types_alive
from cosim.fmu.folder import FmuFolder
from cosim.fmu.guard import Guard
from cosim.fmu.imports import imports_undone
from cosim.fmu.loading import assign, load
from cosim.fmu.log import ERROR, FATAL, FmuLog
from cosim.fmu.parameters import Value, checked_parameters, start_values
from cosim.fmu.run_as import RunAs, choose_run_as
from cosim.fmu.state import FmuState, deserialize, serialize
from cosim.fmu.steps import advance, fixed_step
from cosim.fmu.variables import FmuVariables, by_type
from cosim.participant import Causality, Port


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
    run_as : {"fmu", "python"}, optional
        ``"python"`` runs the script of a Python FMU without its binary. By default the binary, or
        the script where no binary fits this machine.

    Attributes
    ----------
    run_as : {"fmu", "python"}
        What it is run as.
    ports : mapping
        Its numeric inputs and outputs, in the FMU's own units; one an element of an array.
    sha256 : str
        Hash of the file.
    log : FmuLog
        The last messages that the FMU logged, and its warnings.

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
        *,
        run_as: RunAs | None = None,
    ) -> None:
        self.path = Path(path)
        self.name = name
        self.log = FmuLog()
        self._folder = FmuFolder(self.path)
        self._calls: Any = None  # `Calls` while it runs
        self._started = self._begun = False
        self._guard = Guard(self.path, self.log)
        try:
            self.sha256 = hashlib.sha256(self.path.read_bytes()).hexdigest()
            self._description = read_description(self.path, self._folder)
            folder = self._folder.path
            self.run_as = choose_run_as(self.path, self._description, folder, run_as)
            self._parameters = checked_parameters(self.path, self._description, parameters or {})
            self.ports: Mapping[str, Port] = ports_of(self.path, self._description)
            self._fixed = fixed_step(self.path, self._description, folder)
        except BaseException:
            self._folder.close()
            raise
        self._variables = {
            name: variable
            for variable in self._description.modelVariables
            for name in elements(variable)
        }
        self._inputs: dict[tuple[str, ...], list[FmuVariables]] = {}
        self._outputs: list[FmuVariables] = []
        self._values: dict[str, float] = {}
        self._states_out = 0

    @property
    def can_get_and_set_state(self) -> bool:
        """Whether the FMU says that its state can be saved and restored."""
        return bool(self._description.coSimulation.canGetAndSetFMUstate)

    @property
    def can_serialize_state(self) -> bool:
        """Whether it says that its state can be written down, too."""
        serializes = self._description.coSimulation.canSerializeFMUstate
        return self.can_get_and_set_state and bool(serializes)

    @property
    def varies_step(self) -> bool:
        """Whether it says that it takes steps of any length."""
        return self._fixed is None

    def check_step(self, step: float) -> None:
        """Refuse a communication step, s, that the FMU does not take.

        Raises
        ------
        FmuStepError
            If its step is fixed, and this is no multiple of it.
        """
        if self._fixed is not None:
            self._fixed.parts(step)

    def initialize(self, time: float) -> None:
        """Load and instantiate the FMU, set its parameters, and enter initialization."""
        if self._started:
            raise FmuError(f"FMU {self.path} is already running; load it again for a second run")
        self._started = True
        keep_exception_types_alive()
        with imports_undone(self._folder.path):
            about = self._description, self._folder, self.run_as, self.name, self.log
            self._calls = self._guard.call("be loaded", load, *about)
        assign(self._calls, self._parameters, self._guard)
        self._guard.call("enter initialization", self._calls.enter_initialization, time)
        given = [name for name, p in self.ports.items() if p.causality is Causality.OUTPUT]
        self._outputs = self._by_type(given)
        if self._calls.initializes:
            self._read_outputs()
        else:
            self._values = {name: self._start(name) for name in given}

    def begin(self) -> None:
        """Leave initialization."""
        self._guard.call("leave initialization", self._calls.leave_initialization)
        self._begun = True
        self._read_outputs()

    def write(self, values: Mapping[str, float]) -> None:
        """Set inputs, in the FMU's own units. An array is set as a whole."""
        names = tuple(values)
        if names not in self._inputs:
            self._inputs[names] = self._by_type(names)
        for variables in self._inputs[names]:
            self._guard.call("take {}", variables.write, values)

    def step(self, time: float, step: float) -> None:
        """Let the FMU compute one step, in parts where its own step is shorter.

        Raises
        ------
        FmuStepError
            If the FMU does not take a step of this length.
        FmuEndedError
            If it asks to end the simulation.
        FmuError
            If it fails.
        """
        final = not self._states_out
        parts = 1 if self._fixed is None else self._fixed.parts(step)
        for index in range(parts):
            start = time + index * (step / parts)
            advance(self._calls, self._guard, start, step / parts, final=final)
        self._read_outputs()

    def read(self) -> Mapping[str, float]:
        """Outputs after the last call, in the FMU's own units."""
        return self._values

    def get_state(self) -> FmuState:
        """State of the FMU as it is now. The FMU keeps it until it is freed."""
        if not self.can_get_and_set_state:
            raise FmuError(
                f"FMU {self.path} cannot save its state (canGetAndSetFMUstate is false); couple it "
                "without rollback"
            )
        state = self._guard.call("save its state", self._calls.fmu.getFMUState)
        self._states_out += 1
        return FmuState(state, self._values)

    def set_state(self, state: FmuState) -> None:
        """Go back to what `get_state` gave."""
        self._guard.call("go back to a saved state", self._calls.fmu.setFMUState, state.state)
        self._values = dict(state.values)

    def free_state(self, state: FmuState) -> None:
        """Let the FMU forget a saved state."""
        self._states_out -= 1
        self._guard.call("forget a saved state", self._calls.fmu.freeFMUState, state.state)

    def serialize(self) -> bytes:
        """State of the FMU as it is now, for a file."""
        if not self.can_serialize_state:
            raise FmuError(
                f"FMU {self.path} cannot write its state down (canSerializeFMUstate is false), so "
                "a run with it has no checkpoints"
            )
        data: bytes = self._guard.call(
            "write its state down", serialize, self._calls.fmu, self._values
        )
        return data

    def deserialize(self, data: bytes) -> None:
        """Go to what `serialize` gave."""
        self._values = self._guard.call("read a state", deserialize, self._calls.fmu, data)

    def close(self) -> None:
        """End the FMU and remove its folder. May be called twice.

        An FMU that failed is not asked to terminate. After a fatal error it stays loaded and is not
        called again: FMI forbids it, and a Python FMU, which has let go of its objects by then,
        would let go of them once more.
        """
        calls, self._calls = self._calls, None
        self._inputs, self._outputs = {}, []
        try:
            if calls is not None and self._begun and self._guard.worst < ERROR:
                self._guard.call("terminate", calls.fmu.terminate)
        except FmuError as error:  # the run is over by now
            self.log.note(str(error))
        finally:
            if calls is not None and self._guard.worst < FATAL:
                calls.fmu.freeInstance()
            self._folder.close()

    def _read_outputs(self) -> None:
        values: dict[str, float] = {}
        for variables in self._outputs:
            values |= self._guard.call("be read", variables.read)
        self._values = values

    def _by_type(self, names: Sequence[str]) -> list[FmuVariables]:
        variables = list(dict.fromkeys(self._variables[name] for name in names))
        for name in (name for variable in variables for name in elements(variable)):
            if name not in names:
                raise FmuError(f"FMU {self.path} takes an array as a whole; {name} is missing")
        return by_type(self._calls, variables)

    def _start(self, name: str) -> float:
        variable = self._variables[name]
        return float(start_values(self.path, variable)[elements(variable).index(name)])
