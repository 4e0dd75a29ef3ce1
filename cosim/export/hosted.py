"""A participant inside an FMU: its variables, its steps and its state, in every version of FMI."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import version
from typing import Any, Final

from cosim.errors import FmuError
from cosim.export.interface import Interface, Number, Variable
from cosim.participant import Participant
from cosim.units import unit

State = tuple[dict[str, Number], bool, dict[str, Number], Any]
"""Inputs and parameters, whether initialization is over, what came late, the inside's state."""

Conversions = dict[str, tuple[float, float]]
"""Factor and offset by port."""

_PACKAGE: Final = "softbody-cosim"


class Hosted:
    """Offers a participant's ports, in the units of an interface, and parameters.

    The participant is opened when it is first needed, and again after a parameter has changed.

    Parameters
    ----------
    interface : Interface
        What is shown of it.
    open_participant : callable
        Makes it, from the parameters that differ from their start values, by name; with a unit, as
        text.

    Attributes
    ----------
    start_time : float
        To be set before it is opened, s.
    """

    def __init__(
        self,
        interface: Interface,
        open_participant: Callable[[Mapping[str, Number | str]], Participant],
    ) -> None:
        self.start_time = 0.0
        self._interface = interface
        self._open = open_participant
        self._values = {v.name: v.start for v in interface.variables if v.start is not None}
        self._begun = False
        self._late: dict[str, Number] = {}  # parameters that were set too late
        self._participant: Participant | None = None
        self._inputs: Conversions = {}  # into the units of its ports
        self._outputs: Conversions = {}  # and out of them

    @property
    def warning(self) -> str:
        """What to tell the host at once; empty if there is nothing."""
        made, installed = self._interface.version, version(_PACKAGE)
        if made == installed:
            return ""
        return f"made with {_PACKAGE} {made}, runs with {installed}; results may differ"

    def begin(self) -> None:
        """Leave initialization."""
        self._opened().begin()
        self._begun = True

    def step(self, time: float, step: float) -> None:
        """Move on.

        Raises
        ------
        SimulationError
            If the step fails. The participant then stands where it stood. A parameter that came too
            late fails all steps until it is set back or a state from before is restored: refused at
            once, by an exception, it would crash some hosts.
        """
        if self._late:
            late = ", ".join(f"{name} = {value}" for name, value in self._late.items())
            raise FmuError(f"{late} came too late; set it before initialization ends")
        participant = self._opened()
        participant.write(
            {
                name: factor * self._values[name] + offset
                for name, (factor, offset) in self._inputs.items()
            }
        )
        participant.step(time, step)

    def access(
        self, variable: Variable
    ) -> tuple[Callable[[], Number], Callable[[Number], None] | None]:
        """Getter and setter of a variable."""
        name = variable.name

        def output() -> float:
            value = self._opened().read()[name]
            factor, offset = self._outputs[name]
            return factor * value + offset

        def held() -> Number:
            return self._values[name]

        def take_input(value: Number) -> None:
            self._values[name] = value

        def take_parameter(value: Number) -> None:
            if value == self._values[name]:
                self._late.pop(name, None)
                return
            if self._begun:
                self._late[name] = value
                return
            self._values[name] = value
            self._participant = None  # it was made with the value before

        if variable.causality == "output":
            return output, None
        return held, take_input if variable.causality == "input" else take_parameter

    def get_state(self) -> State:
        """All that decides what comes next."""
        inside = None if self._participant is None else self._participant.get_state()
        return dict(self._values), self._begun, dict(self._late), inside

    def set_state(self, state: State) -> None:
        """Go back to what `get_state` gave, here or in a twin."""
        values, begun, late, inside = state
        parameters = [v.name for v in self._interface.variables if v.causality == "parameter"]
        if inside is None or any(values[name] != self._values[name] for name in parameters):
            self._participant = None
        self._values, self._begun, self._late = dict(values), begun, dict(late)
        if inside is not None:
            self._opened().set_state(inside)

    def close(self) -> None:
        """End the participant."""
        if self._participant is not None:
            self._participant.close()

    def _opened(self) -> Participant:
        if self._participant is None:
            self._participant = self._open(
                {
                    v.name: _quantity(self._values[v.name], v.unit)
                    for v in self._interface.variables
                    if v.causality == "parameter" and self._values[v.name] != v.start
                }
            )
            self._participant.initialize(self.start_time)
            self._find_conversions(self._participant)
        return self._participant

    def _find_conversions(self, participant: Participant) -> None:
        for variable in self._interface.variables:
            if variable.causality == "parameter" or variable.unit is None:
                continue
            outside = unit(variable.unit)
            inside = participant.ports[variable.name].unit or outside
            if variable.causality == "input":
                self._inputs[variable.name] = outside.conversion_to(inside)
            else:
                self._outputs[variable.name] = inside.conversion_to(outside)


def _quantity(value: Number, symbol: str | None) -> Number | str:
    return value if symbol in (None, "1") else f"{value!r} {symbol}"
