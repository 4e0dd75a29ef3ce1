"""What takes part in a co-simulation, and its ports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from cosim.units import Unit


class Causality(Enum):
    """Which way values cross a port."""

    INPUT = "input"
    OUTPUT = "output"


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
    """

    name: str
    unit: Unit | None
    causality: Causality
    description: str = ""
    optional: bool = False


class Participant(Protocol):
    """One side of a co-simulation.

    The calls come in this order: `initialize`, `write`, `begin`, then any number of rounds of
    `write`, `step` and `read`, then `close`. `read` is also allowed between `initialize` and
    `begin`. After an error only `read` and `close` are; what `read` gives is then the state before
    the failed call where the participant can tell, and stale otherwise.
    """

    name: str
    ports: Mapping[str, Port]

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

    def close(self) -> None:
        """Give back files, memory and processes. May be called twice."""
