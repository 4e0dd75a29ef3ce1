"""A participant as a pythonfmu slave: what runs inside an FMU of FMI 2.0."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar
from xml.etree.ElementTree import Element

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.enums import Fmi2Status

from cosim.body_bytes import deserialize, serialize
from cosim.export.hosted import Hosted, State
from cosim.export.interface import Interface, Number, Variable
from cosim.participant import Participant
from softbody_core.ground.errors import SimulationError


class ParticipantSlave(Fmi2Slave):  # type: ignore[misc]
    """Shows a participant to a host.

    A subclass gives `interface` and `open`. A step that the participant refuses leaves it where it
    stood: the FMU logs why and discards the step, so that a master may try a shorter one or end.
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
        if self._hosted.warning:
            self.log(self._hosted.warning, Fmi2Status.warning)

    @abstractmethod
    def open(self, folder: Path, changed: Mapping[str, Number | str]) -> Participant:
        """Make the participant.

        Parameters
        ----------
        folder : Path
            The FMU's resources.
        changed : mapping
            Parameters that differ from their start values, by name; with a unit, as text.
        """

    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        self._hosted.start_time = start_time

    def exit_initialization_mode(self) -> None:
        self._hosted.begin()

    def do_step(self, current_time: float, step_size: float) -> bool:
        try:
            self._hosted.step(current_time, step_size)
        except SimulationError as error:
            self.log(str(error), Fmi2Status.discard)
            return False
        return True

    def terminate(self) -> None:
        self._hosted.close()

    def to_xml(self, *arguments: Any) -> Element:
        """As pythonfmu writes it, but with start values to the last bit."""
        root: Element = super().to_xml(*arguments)
        nodes = root.findall("ModelVariables/ScalarVariable")
        for node, variable in zip(nodes, self.interface.variables, strict=True):
            if variable.start is not None:
                node[0].set("start", repr(variable.start))
        return root

    def _register(self, variable: Variable) -> None:
        kind = Integer if variable.is_whole else Real
        continuous, fixed = Fmi2Variability.continuous, Fmi2Variability.fixed
        getter, setter = self._hosted.access(variable)
        entry = kind(
            variable.name,
            causality=Fmi2Causality[variable.causality],
            variability=fixed if variable.causality == "parameter" else continuous,
            description=variable.description,
            getter=getter,
            setter=setter,
        )
        self.register_variable(entry, nested=False)

    def _get_fmu_state(self) -> State:
        return self._hosted.get_state()

    def _set_fmu_state(self, state: State) -> None:
        self._hosted.set_state(state)

    _fmu_state_to_bytes = staticmethod(serialize)
    _fmu_state_from_bytes = staticmethod(deserialize)
