"""What a constraint of C is: points held, weights related, or motion corrected."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from softbody_core.ground.arrays import Booleans, Floats
from softbody_core.mesh import SurfaceMesh
from softbody_core.observation import Observation
from softbody_core.rigid import RigidBody
from softbody_core.state import State
from softbody_core.weights import Weights


class Constraint:
    """A member of C. Override one of the three; each does nothing by default.

    A constraint of one's own is a subclass, given to `SoftBodyModel`; with a line in
    `CONSTRAINTS`, a scenario finds it by name.
    """

    @property
    def obstacles(self) -> tuple[RigidBody, ...]:
        """Rigid bodies that the constraint puts around the body."""
        return ()

    def held(self, mesh: SurfaceMesh) -> Booleans:
        """Return True for each point that stays where it rests, shape (n,)."""
        return np.zeros(mesh.n_points, dtype=np.bool_)

    def related(self, weights: Weights, observation: Observation) -> Weights:
        """Return the weights that hold over the next communication step.

        Parameters
        ----------
        weights : Weights
            Those of the scene, as changed by the constraints before this one.
        observation : Observation
            The body at the start of that step.
        """
        return weights

    def bind(self, mesh: SurfaceMesh, masses: Floats, inverse_masses: Floats) -> Projection | None:
        """Return what corrects the motion after each inner step; None if nothing does.

        Parameters
        ----------
        mesh : SurfaceMesh
            Surface at rest.
        masses : ndarray, shape (n,)
            Point masses, kg.
        inverse_masses : ndarray, shape (n,)
            1/kg; 0 for points that are held.
        """
        return None


class Projection(ABC):
    """Puts the state of one body back onto a constraint, after forces alone have moved it."""

    last: ClassVar[bool] = False
    """Whether it comes after all others, because what they do must not undo it."""

    def start(self, state: State) -> State:
        """Return the state at time 0, with what the constraint adds to it."""
        return state

    @abstractmethod
    def longest_step(self, state: State, dt: float) -> float:
        """Time after which to project again, s, when dt lie ahead."""

    @abstractmethod
    def project(self, before: State, after: State) -> State:
        """Return what `after` becomes when it has to obey the constraint.

        Parameters
        ----------
        before : State
            At the start of the inner step; it obeys the constraint.
        after : State
            At its end, as if the constraint were not there.
        """

    def clearance(self, state: State) -> float:
        """Lower bound of the distance from what may not be passed, m."""
        return np.inf

    def get_state(self) -> object:
        """What is remembered from one step to the next, caches aside; None if nothing."""
        return None

    def set_state(self, state: object) -> None:  # noqa: B027 - nothing to set by default
        """Go back to what `get_state` returned."""
