"""What an integrator is: parameters first, then bound to a model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Protocol

from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State


@dataclass
class Work:
    """What a scheme has done so far. It repeats exactly, whatever the machine.

    Attributes
    ----------
    steps : int
        Internal steps that counted; a step that was tried again in parts is not one of them.
    force_evaluations : int
        Evaluations of the composite force.
    linear_solves : int
        Solutions of a sparse system for three right-hand sides.
    """

    steps: int = 0
    force_evaluations: int = 0
    linear_solves: int = 0

    def reset_to(self, other: Work) -> None:
        """Take over the counts of another."""
        self.steps = other.steps
        self.force_evaluations = other.force_evaluations
        self.linear_solves = other.linear_solves


class Stepper(ABC):
    """A scheme at work on one model. It may keep caches, and a memory that counts as state."""

    work: Work
    """What was done since the scheme was bound."""

    @abstractmethod
    def advance(self, state: State, inputs: Inputs, dt: float) -> State:
        """Carry the body over a communication step, in as many internal steps as it takes.

        Parameters
        ----------
        state : State
            Where the body stands. Not changed, whatever happens.
        inputs : Inputs
            Held over the whole step. They may have jumped since the last one.
        dt : float
            Length of the communication step, s.

        Raises
        ------
        DivergenceError
            If the body leaves the range of physical states.
        StepLimitError
            If the step needs too many internal steps.
        """

    def memory(self) -> object:
        """What the scheme remembers from one communication step to the next; None if nothing."""
        return None

    def recall(self, memory: object) -> None:  # noqa: B027 - nothing to recall by default
        """Set the scheme back to what `memory` returned."""


class Integrator(Protocol):
    """The parameters of a scheme.

    Attributes
    ----------
    order : int or None
        Declared order of convergence of positions and velocities; None for a scheme that neglects
        something, and so converges to another motion.
    """

    order: ClassVar[int | None]

    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the scheme for one model."""
        ...
