"""A participant as a pythonfmu3 slave: what runs inside an FMU of FMI 3.0."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from pythonfmu3 import (
    DefaultExperiment,
    Float64,
    Fmi3Causality,
    Fmi3Slave,
    Fmi3Status,
    Fmi3StepResult,
    Fmi3Variability,
    Int32,
)

from cosim.body_bytes import deserialize, serialize
from cosim.export.hosted import Hosted, State
from cosim.export.interface import Interface, Number, Variable
from cosim.participant import Participant
from softbody_core.ground.errors import SimulationError


class ParticipantSlave(Fmi3Slave):  # type: ignore[misc]
    """Shows a participant to a host, as that for FMI 2.0 does.

    A step that the participant refuses leaves it where it stood: the FMU logs why and discards it.
    """

    interface: ClassVar[Interface]
    units: ClassVar[Mapping[str, str]]
    bounds: ClassVar[Mapping[str, tuple[Number | None, Number | None]]]
    complete_state: ClassVar[bool] = True
    needs_installation: ClassVar[bool] = True

    def __init_subclass__(cls) -> None:
        """Say of the class what `cosim.controllers.build` asks of it."""
        cls.units, cls.bounds = cls.interface.units, cls.interface.bounds

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        shown, folder = self.interface, Path(self.resources)
        self.description, self.version = shown.title, shown.version
        self.default_experiment = DefaultExperiment(0.0, shown.stop, shown.step)
        self._hosted = Hosted(shown, lambda changed: self.open(folder, changed))
        for variable in shown.variables:
            self._register(variable)
        self._time = 0.0
        independent = {"causality": Fmi3Causality.independent, "description": "simulated time"}
        self.register_variable(
            Float64(
                "time",
                variability=Fmi3Variability.continuous,
                getter=lambda: self._time,
                **independent,
            )
        )
        if self._hosted.warning:
            self.log(self._hosted.warning, Fmi3Status.warning)

    @abstractmethod
    def open(self, folder: Path, changed: Mapping[str, Number | str]) -> Participant:
        """Make the participant; see `cosim.export.slave2`."""

    def setup_experiment(self, start_time: float) -> None:
        self._hosted.start_time = self._time = start_time

    def exit_initialization_mode(self) -> None:
        self._hosted.begin()

    def do_step(self, current_time: float, step_size: float) -> Fmi3StepResult:
        try:
            self._hosted.step(current_time, step_size)
        except SimulationError as error:
            self.log(str(error), Fmi3Status.discard)
            return Fmi3StepResult(status=Fmi3Status.discard)
        self._time = current_time + step_size
        return Fmi3StepResult()

    def terminate(self) -> None:
        self._hosted.close()

    def to_xml(self, *arguments: Any) -> Element:
        """As pythonfmu3 writes it, but with start values to the last bit."""
        root: Element = super().to_xml(*arguments)
        nodes = {node.get("name"): node for node in root.find("ModelVariables") or ()}
        for variable in self.interface.variables:
            if variable.start is not None:
                nodes[variable.name].set("start", repr(variable.start))
        return root

    def _register(self, variable: Variable) -> None:
        kind = Int32 if variable.is_whole else Float64
        # A whole number's variability has to be said; a port's is that of a number that moves.
        continuous, fixed = Fmi3Variability.continuous, Fmi3Variability.fixed
        getter, setter = self._hosted.access(variable)
        entry = kind(
            variable.name,
            causality=Fmi3Causality[variable.causality],
            variability=fixed if variable.causality == "parameter" else continuous,
            description=variable.description,
            getter=getter,
            setter=setter,
        )
        self.register_variable(entry, nested=False)

    def _get_fmu_state(self) -> tuple[float, State]:
        return self._time, self._hosted.get_state()

    def _set_fmu_state(self, state: tuple[float, State]) -> None:
        self._time, hosted = state
        self._hosted.set_state(hosted)

    _fmu_state_to_bytes = staticmethod(serialize)
    _fmu_state_from_bytes = staticmethod(deserialize)
