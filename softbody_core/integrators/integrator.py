"""What an integrator is: parameters first, then bound to a model as a stepper."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from softbody_core.ground.parameters import Parameters
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State


@dataclass
class Counters:
    """What a stepper has done so far. It repeats exactly, whatever the machine.

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

    def reset_to(self, other: Counters) -> None:
        """Take over the counts of another."""
        self.steps = other.steps
        self.force_evaluations = other.force_evaluations
        self.linear_solves = other.linear_solves


class Stepper(ABC):
    """An integrator at work on one model. It may keep caches, and a state of its own."""

    counters: Counters
    """What was done since the integrator was bound."""

    @abstractmethod
    def advance(self, state: State, inputs: Inputs, dt: float) -> State:
        """Carry the body over a time in which no constraint acts, in as many steps as it takes.

        Parameters
        ----------
        state : State
            Where the body stands. Not changed, whatever happens.
        inputs : Inputs
            Held over the whole time. They may have jumped since the last one.
        dt : float
            Length of that time, s: of a communication step, or of a part of it.

        Raises
        ------
        DivergenceError
            If the body leaves the range of physical states.
        StepLimitError
            If it takes too many internal steps.
        """

    def get_state(self) -> object:
        """What is remembered from one communication step to the next; None if nothing."""
        return None

    def set_state(self, state: object) -> None:  # noqa: B027 - nothing to set by default
        """Go back to what `get_state` returned."""


@dataclass(frozen=True)
class Integrator(Parameters, ABC):
    """The parameters of an integrator.

    Attributes
    ----------
    order : int or None
        Declared order of convergence of positions and velocities; None for an integrator that
        neglects something, and so converges to another motion.
    stability_limit : float
        Largest stable step times the angular frequency of an undamped oscillation; infinite where
        stability asks for no step.
    """

    order: ClassVar[int | None]
    stability_limit: ClassVar[float] = math.inf

    @abstractmethod
    def bind(self, model: SoftBodyModel) -> Stepper:
        """Prepare the integrator for one model."""
