"""What points and a wall do to each other's velocities where they touch.

A point that moves into the wall loses its normal velocity relative to the wall, and of its
tangential velocity as much as Coulomb's friction allows: an impulse of at most μ times the normal
one. What the points lose, a free rigid body gains.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from softbody_core.configuration import norms
from softbody_core.rigid import RigidBody
from softbody_core.state import RigidState

Floats = NDArray[np.float64]

_MOST_ITERATIONS: Final = 50

_SETTLED: Final = 1e-12
"""Change of the rigid body's velocities, over their size, at which they are found."""


@dataclass(frozen=True, eq=False)
class Touching:
    """Points that touch one wall.

    Attributes
    ----------
    masses : ndarray, shape (k,)
        kg.
    velocities : ndarray, shape (3, k)
        m/s.
    normals : ndarray, shape (3, k)
        Unit normals off the wall.
    arms : ndarray, shape (3, k)
        Points seen from the rigid body's centre of mass, m.
    friction : float
        μ.
    """

    masses: Floats
    velocities: Floats
    normals: Floats
    arms: Floats
    friction: float

    def impulses(self, motion: Floats) -> tuple[Floats, Floats]:
        """Impulses on the points, N·s, if the wall keeps a motion (V, Ω), shape (6,).

        Also the tangential impulse over m w_t, 1 where the point sticks.
        """
        wall = motion[:3, None] + np.cross(motion[3:], self.arms, axisb=0).T
        relative = self.velocities - wall
        into = np.minimum(np.einsum("ck,ck->k", relative, self.normals), 0.0)
        along = relative - np.einsum("ck,ck->k", relative, self.normals) * self.normals
        speed = np.maximum(norms(along), np.finfo(float).tiny)
        grip = np.minimum(1.0, -self.friction * into / speed)
        return -self.masses * (into * self.normals + grip * along), grip

    def on_body(self, impulses: Floats) -> Floats:
        """Impulse and angular impulse that a body receives in return, shape (6,)."""
        turning = np.cross(self.arms, impulses, axis=0)
        return -np.concatenate([impulses.sum(axis=1), turning.sum(axis=1)])


def strike_fixed(touching: Touching, motion: Floats) -> Floats:
    """Velocities of the points, m/s, after touching a wall whose motion nothing changes."""
    impulses, _ = touching.impulses(motion)
    return touching.velocities + impulses / touching.masses


def strike_free(
    touching: Touching, body: RigidBody, state: RigidState
) -> tuple[Floats, RigidState]:
    """Velocities of the points, m/s, and the rigid body after touching each other.

    Impulses depend on the body's motion z = (V, Ω) after the blow: z = z₀ + B Wᵀp(z), six
    equations, by Newton's method with friction's slope taken as that of a damper. Whatever z it
    ends at, the momentum that the body gains is what the points lose.
    """
    assert body.mass is not None  # noqa: S101 - a free body has one
    inertia = state.rotation @ body.inertia @ state.rotation.T
    mobility = np.zeros((6, 6))
    mobility[:3, :3] = np.eye(3) / body.mass
    mobility[3:, 3:] = np.linalg.inv(inertia)
    before = np.concatenate([state.velocity, state.angular_velocity])
    motion = before
    for _ in range(_MOST_ITERATIONS):
        impulses, grip = touching.impulses(motion)
        gained = mobility @ touching.on_body(impulses)
        slope = np.eye(6) + mobility @ _damping(touching, impulses, grip)
        change = np.linalg.solve(slope, before + gained - motion)
        motion = motion + change
        if np.linalg.norm(change) <= _SETTLED * np.linalg.norm(motion):
            break
    impulses, _ = touching.impulses(motion)
    motion = before + mobility @ touching.on_body(impulses)
    struck = replace(state, velocity=motion[:3], angular_velocity=motion[3:])
    return touching.velocities + impulses / touching.masses, struck


def _damping(touching: Touching, impulses: Floats, grip: Floats) -> Floats:
    """−∂(Wᵀp)/∂z of the points that are pushed, shape (6, 6)."""
    pushed = np.einsum("ck,ck->k", impulses, touching.normals) > 0
    n, r, m = touching.normals[:, pushed], touching.arms[:, pushed], touching.masses[pushed]
    held = grip[pushed]
    # Each point resists by m [n nᵀ + grip (1 − n nᵀ)].
    tensor = (1 - held) * n[:, None] * n[None] + held * np.eye(3)[:, :, None]
    tensor *= m
    arm = np.zeros((3, 6, r.shape[1]))  # W: the wall's velocity at the point is V + Ω × r
    arm[0, 0] = arm[1, 1] = arm[2, 2] = 1.0
    arm[0, 4], arm[0, 5] = r[2], -r[1]
    arm[1, 3], arm[1, 5] = -r[2], r[0]
    arm[2, 3], arm[2, 4] = r[1], -r[0]
    damping: Floats = np.einsum("aik,abk,bjk->ij", arm, tensor, arm)
    return damping
