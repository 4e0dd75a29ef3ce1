"""What changes: time, positions, velocities, rigid bodies around, and the inputs held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.mesh import SurfaceMesh


@dataclass(frozen=True, eq=False)
class RigidState:
    """One instant of a rigid body.

    Attributes
    ----------
    position : ndarray, shape (3,)
        Centre of mass, m.
    rotation : ndarray, shape (3, 3)
        Turns vectors of the body as it was given into the world.
    velocity : ndarray, shape (3,)
        Of the centre of mass, m/s.
    angular_velocity : ndarray, shape (3,)
        In the world's axes, rad/s.
    """

    position: Floats
    rotation: Floats
    velocity: Floats
    angular_velocity: Floats


@dataclass(frozen=True, eq=False)
class State:
    """One instant of a body.

    Attributes
    ----------
    time : float
        Simulated time, s.
    positions, velocities : ndarray, shape (3, n)
        m and m/s, one row a component.
    obstacles : tuple of RigidState
        The rigid bodies around it.
    """

    time: float
    positions: Floats
    velocities: Floats
    obstacles: tuple[RigidState, ...] = ()

    @classmethod
    def at_rest(cls, mesh: SurfaceMesh) -> State:
        """Return the mesh at its rest positions, at time 0, without motion."""
        positions = np.ascontiguousarray(mesh.points.T)
        return cls(0.0, positions, np.zeros_like(positions))


@dataclass(frozen=True)
class Inputs(Parameters):
    """The body's two inputs, held over a communication step (S3D's N, and the wall pressure).

    Attributes
    ----------
    delta_p : float
        Pressure difference across the wall, Pa, positive outward.
    n : float
        Number proportional to the molecules inside, 1.
    """

    delta_p: Annotated[float, Quantity("Pa")] = 0.0
    n: Annotated[float, Quantity("1", at_least=0)] = 0.0
