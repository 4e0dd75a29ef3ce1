"""The rigid body R3D = ⟨O, F, V⟩ of Mesit & Guha (2011), section 2."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from softbody_core.forces.gravity import STANDARD_GRAVITY
from softbody_core.ground.arrays import Floats
from softbody_core.ground.errors import ParameterError
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.mesh import SurfaceMesh
from softbody_core.state import RigidState

Vector = tuple[float, float, float]

_STILL: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class RigidBody(Parameters):
    """A closed surface that does not deform, filled evenly with its mass.

    Parameters
    ----------
    mesh : SurfaceMesh
        The surface, where it stands at time 0. Any closed triangle mesh.
    motion : {"fixed", "driven", "free"}
        ``"fixed"`` stays; ``"driven"`` keeps its velocities whatever it meets; ``"free"`` obeys
        its force, its weight, and what touches it.
    mass : float, optional
        kg; a free body needs it.
    velocity : tuple of float
        V at time 0, of the centre of mass, m/s.
    angular_velocity : tuple of float
        About the centre of mass at time 0, in the world's axes, rad/s.
    force : tuple of float
        F, a constant force at the centre of mass, N.
    gravity : float
        |g| along −z, m/s².
    name : str
        For messages and datasets.

    Raises
    ------
    ParameterError
        If a free body has no mass, or a fixed one a velocity.
    """

    mesh: SurfaceMesh
    motion: Literal["fixed", "driven", "free"] = "fixed"
    mass: Annotated[float | None, Quantity("kg", above=0)] = None
    velocity: Vector = _STILL
    angular_velocity: Vector = _STILL
    force: Vector = _STILL
    gravity: Annotated[float, Quantity("m/s^2", at_least=0)] = STANDARD_GRAVITY
    name: str = "obstacle"

    def __post_init__(self) -> None:
        """Check what the motion needs."""
        super().__post_init__()
        vectors = {
            "velocity": self.velocity,
            "angular_velocity": self.angular_velocity,
            "force": self.force,
        }
        for name, vector in vectors.items():
            numbers = all(isinstance(part, int | float | np.number) for part in np.ravel(vector))
            if np.shape(vector) != (3,) or not numbers or not np.isfinite(vector).all():
                raise ParameterError(f"{self.name}.{name} = {vector}: expected three numbers")
        if self.motion not in ("fixed", "driven", "free"):
            raise ParameterError(
                f"{self.name}.motion = {self.motion!r}: expected fixed, driven or free"
            )
        if self.motion == "free" and self.mass is None:
            raise ParameterError(f"{self.name}.mass is missing: a free body needs one, in kg")
        if self.motion == "fixed" and any((*self.velocity, *self.angular_velocity)):
            raise ParameterError(f'{self.name} is fixed and has a velocity; try motion = "driven"')

    @property
    def moves(self) -> bool:
        """False for a body that stays where it is."""
        return self.motion != "fixed"

    @cached_property
    def centre(self) -> Floats:
        """Centre of mass at time 0, m, shape (3,)."""
        return np.asarray(self.mesh.points.mean(axis=0) + self._solid.center_mass)

    @cached_property
    def inertia(self) -> Floats:
        """Inertia about the centre of mass at time 0, kg·m², shape (3, 3); a free body's."""
        if self.mass is None:
            raise ParameterError(f"{self.name} has no mass, so it has no inertia")
        density = self.mass / float(self._solid.volume)
        return np.asarray(density * self._solid.moment_inertia)

    @cached_property
    def _solid(self) -> trimesh.Trimesh:
        # About the middle of its points: far from the origin its integrals lose digits.
        middle = self.mesh.points.mean(axis=0)
        return trimesh.Trimesh(self.mesh.points - middle, self.mesh.triangles, process=False)

    @cached_property
    def points(self) -> Floats:
        """Points of the surface, seen from its centre of mass at time 0, m, shape (m, 3)."""
        return np.asarray(self.mesh.points - self.centre)

    def start(self) -> RigidState:
        """Return the body at time 0."""
        return RigidState(
            self.centre, np.eye(3), np.array(self.velocity), np.array(self.angular_velocity)
        )

    def advance(self, state: RigidState, h: float) -> RigidState:
        """Move freely for h seconds: exact in translation, second order in rotation.

        The angular momentum is kept exactly (Euler's equations without torque).
        """
        if self.motion == "fixed":
            return state
        omega = state.angular_velocity
        if self.motion == "driven":
            turned = _turn(omega * h) @ state.rotation
            return RigidState(state.position + h * state.velocity, turned, state.velocity, omega)
        assert self.mass is not None  # noqa: S101 - a free body has one, checked when it was made
        acceleration = np.array(self.force) / self.mass - [0, 0, self.gravity]
        position = state.position + h * state.velocity + 0.5 * h * h * acceleration
        momentum = state.rotation @ self.inertia @ state.rotation.T @ omega
        halfway = _turn(omega * (h / 2)) @ state.rotation
        turned = _turn(self.spin(halfway, momentum) * h) @ state.rotation
        velocity = state.velocity + h * acceleration
        return RigidState(position, turned, velocity, self.spin(turned, momentum))

    def spin(self, rotation: Floats, angular_momentum: Floats) -> Floats:
        """Angular velocity, rad/s, that carries an angular momentum, kg·m²/s."""
        spin: Floats = rotation @ np.linalg.solve(self.inertia, rotation.T @ angular_momentum)
        return spin

    def surface(self, state: RigidState) -> Floats:
        """Points of the surface in the world, m, shape (m, 3)."""
        return np.asarray(self.points @ state.rotation.T + state.position)


def _turn(rotation_vector: Floats) -> Floats:
    return np.asarray(Rotation.from_rotvec(rotation_vector).as_matrix())
