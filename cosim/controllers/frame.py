"""What a controller of ours is: variables, and an action at the start of each frame.

A controller derives from `Controller`, declares its variables one a line, and gives `act`. When it
is built, this text is put in the place of its import, so that the FMU stands alone. Therefore there
is no ``from __future__`` here.
"""

import math
from typing import Any, ClassVar, Final, NamedTuple, TypeVar

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String
from pythonfmu.default_experiment import DefaultExperiment

INHALING, EXHALING = 1, 0

SLACK: Final = 1e-6
"""Part of a frame by which it may come early: it stays on a communication point it falls on."""

Start = TypeVar("Start", float, int, bool, str)


class Variable(NamedTuple):
    """A variable of the FMU; the attribute of that name holds its value."""

    causality: Fmi2Causality
    variability: Fmi2Variability
    start: Any
    unit: str | None
    description: str
    bounds: tuple[float | None, float | None] = (None, None)


def input_(start: Start, unit: str | None, description: str) -> Start:
    """Declare what the controller takes; a unit that converts to the body's will do."""
    variability = Fmi2Variability.continuous
    return Variable(Fmi2Causality.input, variability, start, unit, description)  # type: ignore[return-value]


def output(start: Start, unit: str | None, description: str) -> Start:
    """Declare what the controller gives; it holds it until the next frame."""
    variability = Fmi2Variability.discrete
    return Variable(Fmi2Causality.output, variability, start, unit, description)  # type: ignore[return-value]


def local(start: Start, unit: str | None, description: str) -> Start:
    """Declare what the controller has to remember; with the outputs, it is all of its state."""
    variability = Fmi2Variability.discrete
    return Variable(Fmi2Causality.local, variability, start, unit, description)  # type: ignore[return-value]


def parameter(
    start: Start,
    unit: str | None,
    description: str,
    at_least: float | None = None,
    at_most: float | None = None,
) -> Start:
    """Declare what a user may set before a run."""
    bounds = (at_least, at_most)
    variability = Fmi2Variability.fixed
    return Variable(Fmi2Causality.parameter, variability, start, unit, description, bounds)  # type: ignore[return-value]


class Frame(NamedTuple):
    """A frame: between two of them, the controller holds its outputs.

    Attributes
    ----------
    number : int
        0 at time 0.
    time : float
        Its start, s; a millionth of a frame late, so that what begins with it has begun.
    length : float
        To the next one, s.
    """

    number: int
    time: float
    length: float


class Controller(Fmi2Slave):
    """A controller that acts at frames, or overrides `do_step`."""

    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True  # all of it is in variables, so the FMU can be saved and restored
    variables: ClassVar[dict[str, Variable]] = {}
    units: ClassVar[dict[str, str]] = {}
    bounds: ClassVar[dict[str, tuple[float | None, float | None]]] = {}

    frame: float

    def __init_subclass__(cls) -> None:
        """Collect what the class declares; the build reads `units` and `bounds`."""
        declared = {name: v for name, v in vars(cls).items() if isinstance(v, Variable)}
        cls.variables = {**cls.variables, **declared}
        cls.units = {name: v.unit for name, v in cls.variables.items() if v.unit is not None}
        cls.bounds = {n: v.bounds for n, v in cls.variables.items() if v.bounds != (None, None)}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        taken = {*dir(Controller), *vars(self)}
        kinds = {float: Real, int: Integer, bool: Boolean, str: String}
        for name, (causality, variability, start, _, description, _) in self.variables.items():
            if name in taken:
                raise TypeError(f"variable {name!r}: a controller needs that name; choose another")
            setattr(self, name, start)
            entry = kinds[type(start)](
                name, causality=causality, variability=variability, description=description
            )
            self.register_variable(entry)

    @property
    def frame_length(self) -> float:
        """Time from one action to the next, s; the parameter `frame`, if nothing else is said."""
        return self.frame

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Act at each frame that begins in this step."""
        length = self.frame_length
        ends = (current_time, current_time + step_size)
        for number in range(*(math.ceil(end / length - SLACK) for end in ends)):
            self.act(Frame(number, (number + SLACK) * length, length))
        return True

    def act(self, frame: Frame) -> None:
        """Set the outputs for one frame."""
        raise NotImplementedError(f"{type(self).__name__} has no act()")

    def require(self, fulfilled: bool, name: str, expected: str) -> None:
        """Refuse the value of a parameter unless a condition is fulfilled.

        Raises
        ------
        ValueError
            If it is not.
        """
        if not fulfilled:
            raise ValueError(f"{name} = {self.value_of(name)}: expected {expected}")

    def value_of(self, name: str) -> str:
        """Value and unit of a variable, as text."""
        unit = self.units.get(name, "1")
        return repr(getattr(self, name)) + ("" if unit == "1" else f" {unit}")
