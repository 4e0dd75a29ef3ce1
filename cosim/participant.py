"""What takes part in a co-simulation, and its ports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Protocol

from cosim.units import Unit


class Causality(Enum):
    """Which way values cross a port."""

    INPUT = "input"
    OUTPUT = "output"


class Variability(Enum):
    """How the value of a port changes with time; FMI's word."""

    CONTINUOUS = "continuous"
    """All the time, so it can be interpolated."""

    SAMPLED = "sampled"
    """At instants, and it is held in between."""

    MODE = "mode"
    """As `SAMPLED`, and it counts or is true or false: a change of it is an event."""


@dataclass(frozen=True)
class Port:
    """One value that a participant takes or gives.

    Attributes
    ----------
    name : str
        Unique within the participant.
    unit : Unit or None
        None if the participant does not declare one.
    causality : Causality
        Input or output.
    description : str
        For people.
    optional : bool
        True for an input that has a neutral value when it is left unconnected.
    variability : Variability
        How its value changes with time.
    """

    name: str
    unit: Unit | None
    causality: Causality
    description: str = ""
    optional: bool = False
    variability: Variability = Variability.CONTINUOUS


class Participant(Protocol):
    """One side of a co-simulation.

    The calls come in this order: `initialize`, `write`, `begin`, then any number of rounds of
    `write`, `step` and `read`, then `close`. `read` is also allowed between `initialize` and
    `begin`. After an error only `read` and `close` are; what `read` gives is then the state before
    the failed call where the participant can tell, and stale otherwise.

    State: a participant with `can_get_and_set_state` gives its state with `get_state`, between
    `begin` and `close`, and goes back to it with `set_state`, as often as need be. What follows
    repeats to the bit. With `can_serialize_state` that state also goes to bytes and back, in
    another process too: `deserialize` takes the place of `set_state` in a participant of the same
    kind after its `begin`. A participant without them is stepped forward only. These are the words
    of FMI.

    Attributes
    ----------
    name : str
        Unique within the co-simulation.
    ports : mapping
        By name.
    can_get_and_set_state : bool
        Whether `get_state`, `set_state` and `free_state` work.
    can_serialize_state : bool
        Whether `serialize` and `deserialize` do. Never without `can_get_and_set_state`.
    varies_step : bool
        Whether it takes steps of any length. If not, parts of a communication step are not asked
        of it.
    """

    name: str
    ports: Mapping[str, Port]

    @property
    def can_get_and_set_state(self) -> bool: ...

    @property
    def can_serialize_state(self) -> bool: ...

    @property
    def varies_step(self) -> bool: ...

    def initialize(self, time: float) -> None:
        """Get ready to start at `time`, s."""

    def begin(self) -> None:
        """Leave initialization: from here on, time moves."""

    def write(self, values: Mapping[str, float]) -> None:
        """Set inputs, by port name, in the ports' own units."""

    def step(self, time: float, step: float) -> None:
        """Move on from `time` by `step`, s."""

    def read(self) -> Mapping[str, float]:
        """Values of all outputs, by port name, in the ports' own units."""
        ...

    def get_state(self) -> object:
        """State as it is now: inputs, outputs, all that decides what comes next."""

    def set_state(self, state: Any) -> None:
        """Go back to a state that `get_state` gave and `free_state` did not yet take."""

    def free_state(self, state: Any) -> None:
        """Let go of a state that is no longer needed."""

    def serialize(self) -> bytes:
        """State as it is now, for a file."""
        ...

    def deserialize(self, data: bytes) -> None:
        """Go to a state that `serialize` gave."""

    def close(self) -> None:
        """Give back files, memory and processes. May be called twice."""
