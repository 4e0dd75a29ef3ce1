"""What points and an obstacle do to each other's velocities where they touch.

A point that moves into the obstacle loses its normal velocity relative to the obstacle, and of its
tangential velocity as much as Coulomb's friction allows: an impulse of at most μ times the normal
one. What the points lose, a free rigid body gains.

With bounds on friction that are given, a blow is the minimum of a convex function of the obstacle's
motion, so it exists, is found, and takes energy. The bounds then follow the normal impulses, until
they settle or, where points much heavier than the body rub hard, for `_MOST_ITERATIONS`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from softbody_core.configuration import norms
from softbody_core.ground.arrays import Floats
from softbody_core.rigid import RigidBody
from softbody_core.state import RigidState

_MOST_ITERATIONS: Final = 50

_SETTLED: Final = 1e-12
"""Relative change of the rigid body's motion, or of friction, at which they are found."""

_ROUNDING: Final = 1e-14
"""Relative rise of the potential that counts as none."""


@dataclass(frozen=True, eq=False)
class Touching:
    """Points that touch one obstacle.

    Attributes
    ----------
    masses : ndarray, shape (k,)
        kg.
    velocities : ndarray, shape (3, k)
        m/s.
    normals : ndarray, shape (3, k)
        Unit normals off the obstacle.
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

    def relative(self, motion: Floats) -> tuple[Floats, Floats]:
        """Velocities into the obstacle, m/s, (k,), at most 0, and along it, (3, k).

        The obstacle moves like a rigid body, with a motion (V, Ω), shape (6,).
        """
        surface = motion[:3, None] + np.cross(motion[3:], self.arms, axisb=0).T
        relative = self.velocities - surface
        normal = np.einsum("ck,ck->k", relative, self.normals)
        return np.minimum(normal, 0.0), relative - normal * self.normals

    def most_friction(self, motion: Floats) -> Floats:
        """Coulomb's bound on the tangential impulses, μ times the normal ones, N·s, (k,)."""
        into, _ = self.relative(motion)
        return -self.friction * self.masses * into

    def grip(self, along: Floats, most: Floats) -> Floats:
        """Tangential impulse over the one that sticks, (k,): 1 where the bound allows that."""
        needed = np.maximum(self.masses * norms(along), np.finfo(float).tiny)
        return np.minimum(1.0, most / needed)

    def impulses(self, motion: Floats, most: Floats) -> Floats:
        """Impulses on the points, N·s, shape (3, k), if the obstacle keeps a motion."""
        into, along = self.relative(motion)
        grip = self.grip(along, most)
        return -self.masses * (into * self.normals + grip * along)

    def potential(self, motion: Floats, most: Floats) -> float:
        """Function of the motion whose slope is what the obstacle receives, J."""
        into, along = self.relative(motion)
        grip = self.grip(along, most)
        square = into**2 + (2 * grip - grip**2) * np.einsum("ck,ck->k", along, along)
        return 0.5 * float(np.vdot(self.masses, square))

    def on_body(self, impulses: Floats) -> Floats:
        """Impulse and angular impulse that a body receives in return, shape (6,)."""
        turning = np.cross(self.arms, impulses, axis=0)
        return -np.concatenate([impulses.sum(axis=1), turning.sum(axis=1)])


def strike_fixed(touching: Touching, motion: Floats) -> tuple[Floats, Floats]:
    """Velocities of the points, m/s, after touching an obstacle whose motion nothing changes.

    Also the share of its motion along the obstacle that each point has lost, (k,).
    """
    return _struck(touching, motion, touching.most_friction(motion))


def strike_free(
    touching: Touching, body: RigidBody, state: RigidState
) -> tuple[Floats, Floats, RigidState]:
    """Velocities and shares lost as `strike_fixed`, and the rigid body, after touching each other.

    Impulses depend on the body's motion z = (V, Ω) after the blow: M (z − z₀) = −Wᵀp(z), six
    equations. Whatever z it ends at, the momentum that the body gains is what the points lose.
    """
    assert body.mass is not None  # noqa: S101 - a free body has one
    inertia = np.zeros((6, 6))
    inertia[:3, :3] = body.mass * np.eye(3)
    inertia[3:, 3:] = state.rotation @ body.inertia @ state.rotation.T
    before = np.concatenate([state.velocity, state.angular_velocity])
    most = np.zeros_like(touching.masses)
    motion = _settled(touching, inertia, before, before, most)
    for _ in range(_MOST_ITERATIONS):
        last, most = most, touching.most_friction(motion)
        if np.abs(most - last).max() <= _SETTLED * most.max():
            break
        motion = _settled(touching, inertia, before, motion, most)
    gained = touching.on_body(touching.impulses(motion, most))
    velocities, grip = _struck(touching, motion, most)
    motion = before + np.linalg.solve(inertia, gained)
    return velocities, grip, replace(state, velocity=motion[:3], angular_velocity=motion[3:])


def _struck(touching: Touching, motion: Floats, most: Floats) -> tuple[Floats, Floats]:
    impulses = touching.impulses(motion, most)
    _, along = touching.relative(motion)
    return touching.velocities + impulses / touching.masses, touching.grip(along, most)


def _settled(
    touching: Touching, inertia: Floats, before: Floats, motion: Floats, most: Floats
) -> Floats:
    """Motion of the body after a blow with given bounds on friction, by Newton's method."""

    def potential(z: Floats) -> float:
        return 0.5 * float((z - before) @ inertia @ (z - before)) + touching.potential(z, most)

    value = potential(motion)
    for _ in range(_MOST_ITERATIONS):
        gained = touching.on_body(touching.impulses(motion, most))
        slope = inertia + _damping(touching, motion, most)
        change = np.linalg.solve(slope, gained - inertia @ (motion - before))
        while (changed := potential(motion + change)) > value * (1 + _ROUNDING):
            change = change / 2
        motion, value = motion + change, changed
        if np.linalg.norm(change) <= _SETTLED * np.linalg.norm(motion):
            break
    return motion


def _damping(touching: Touching, motion: Floats, most: Floats) -> Floats:
    """Second derivative of the potential, kg …, shape (6, 6)."""
    into, along = touching.relative(motion)
    grip = touching.grip(along, most)
    acting = (into < 0) | (most > 0)
    n, r, m = touching.normals[:, acting], touching.arms[:, acting], touching.masses[acting]
    held, pressed, along = grip[acting], into[acting] < 0, along[:, acting]
    # Each point resists by m [n nᵀ, if it is pressed, + grip (1 − n nᵀ)], less the direction in
    # which it slides, where friction does not grow.
    slides = along / np.maximum(norms(along), np.finfo(float).tiny) * np.sqrt(held * (held < 1))
    tensor = (pressed - held) * n[:, None] * n[None] + held * np.eye(3)[:, :, None]
    tensor -= slides[:, None] * slides[None]
    tensor *= m
    arm = np.zeros((3, 6, r.shape[1]))  # W: the obstacle's velocity at the point is V + Ω × r
    arm[0, 0] = arm[1, 1] = arm[2, 2] = 1.0
    arm[0, 4], arm[0, 5] = r[2], -r[1]
    arm[1, 3], arm[1, 5] = -r[2], r[0]
    arm[2, 3], arm[2, 4] = r[1], -r[0]
    damping: Floats = np.einsum("aik,abk,bjk->ij", arm, tensor, arm)
    return damping
