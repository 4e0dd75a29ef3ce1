"""How far something has come that takes a while."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:  # a command that prints its help has no use for a body
    from softbody_core import Counters


class Counted(Protocol):
    """What runs and studies report alike: what goes on, how much of it is done, and of how much."""

    @property
    def name(self) -> str: ...
    @property
    def done(self) -> float: ...
    @property
    def total(self) -> float: ...


@dataclass(frozen=True)
class Progress:
    """How far a run has come; what is counted is simulated time, s.

    Attributes
    ----------
    time, duration : float
        Simulated so far, and in all, s.
    wall_time : float
        Computing time so far, s.
    counters : Counters
        What the integrator has done so far.
    """

    time: float
    duration: float
    wall_time: float
    counters: Counters

    @property
    def work(self) -> Counters:
        """The same as `counters`; older name."""
        return self.counters

    @property
    def name(self) -> str:
        """What goes on."""
        return "run"

    @property
    def done(self) -> float:
        """Simulated so far, s."""
        return self.time

    @property
    def total(self) -> float:
        """To be simulated in all, s."""
        return self.duration

    @property
    def speed(self) -> float:
        """Simulated over computing time; 0 as long as there is none."""
        return self.time / self.wall_time if self.wall_time > 0 else 0.0


@dataclass(frozen=True)
class StudyProgress:
    """How far a study has come.

    Attributes
    ----------
    name : str
        What goes on now.
    done : float
        Parts that are done, with the share of the one that goes on now.
    total : int
        Parts in all.
    """

    name: str
    done: float
    total: int

    @property
    def part(self) -> int:
        """Number of the part that goes on now; the first one is 1."""
        return min(int(self.done) + 1, self.total)


Watch = Callable[[StudyProgress], None]
"""Called with the progress of a study."""


def unwatched(progress: Counted) -> None:
    """Take notice of nothing: for whoever is not interested in progress."""
