"""Contact of a soft body's points with rigid bodies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Final, cast

import numpy as np

from softbody_core.configuration import norms
from softbody_core.constraints.constraint import Constraint, Projection
from softbody_core.contact.closest_point import ClosestPoint
from softbody_core.contact.impulses import Touching, strike_fixed, strike_free
from softbody_core.contact.sweep import Arrival, Surroundings, Sweep
from softbody_core.errors import SqueezedError
from softbody_core.ground.arrays import Booleans, Floats
from softbody_core.ground.errors import ParameterError
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.mesh import SurfaceMesh
from softbody_core.rigid import RigidBody
from softbody_core.state import RigidState, State

_MOST_ROUNDS: Final = 8
"""Times that all obstacles are gone through, where one pushes a point towards another."""


@dataclass(frozen=True)
class Contact(Parameters, Constraint):
    """Points do not enter rigid bodies; friction slows them along the surfaces.

    After each inner step, ways that end in an obstacle, or beyond it, are cut short there, and the
    velocities of points that touch are corrected by impulses. Obstacles act on points, not on the
    triangles between them: an edge of a body that is finer than the soft mesh can pass between its
    points. Rigid bodies do not touch each other, and held points touch nothing.

    Parameters
    ----------
    bodies : tuple of RigidBody
        The obstacles.
    friction : float
        Coulomb's μ, for all of them.
    thickness : float, optional
        Distance at which a point touches, m; by default a tenth of the mean edge at rest.
    max_step : float
        Longest inner step while something is near, s.
    """

    bodies: tuple[RigidBody, ...] = ()
    friction: Annotated[float, Quantity("1", at_least=0)] = 0.3
    thickness: Annotated[float | None, Quantity("m", above=0)] = None
    max_step: Annotated[float, Quantity("s", above=0)] = 2e-3

    @property
    def obstacles(self) -> tuple[RigidBody, ...]:
        """The rigid bodies."""
        return self.bodies

    def bind(self, mesh: SurfaceMesh, masses: Floats, inverse_masses: Floats) -> Projection | None:
        """Put the obstacles around one body."""
        return ContactProjection(self, mesh, masses, inverse_masses > 0) if self.bodies else None


class ContactProjection(Projection):
    """The obstacles around one body."""

    last = True

    def __init__(self, contact: Contact, mesh: SurfaceMesh, masses: Floats, free: Booleans) -> None:
        self._contact = contact
        self._bodies = contact.bodies
        self._points = np.flatnonzero(free)
        self._all_free = bool(free.all())
        self._masses = masses[self._points]
        thickness = contact.thickness
        self._thickness = 0.1 * float(mesh.edge_lengths.mean()) if thickness is None else thickness
        self._surfaces = [ClosestPoint(_shape(b), b.mesh.triangles) for b in self._bodies]
        self._sweeps = [Sweep(surface, self._thickness) for surface in self._surfaces]

    def start(self, state: State) -> State:
        """Put the obstacles where they stand at time 0.

        Raises
        ------
        ParameterError
            If a point of the body is inside an obstacle, or touches it.
        """
        started = replace(state, obstacles=tuple(body.start() for body in self._bodies))
        self._refuse_inside(started, self._thickness)
        return started

    def _refuse_inside(self, state: State, least: float) -> None:
        """Raise for points inside an obstacle, or nearer than `least` to it, m."""
        for body, obstacle, surface in zip(
            self._bodies, state.obstacles, self._surfaces, strict=True
        ):
            places = _into_frame(body, obstacle, self._touchable(state))
            near = surface.distance_to_box(places) <= least
            if not near.any():
                continue
            _, distance = surface(places[:, near])
            bad = surface.inside(places[:, near]) | (distance < least)
            if bad.any():
                point = self._points[near][bad][0]
                where = ", ".join(f"{x:.4g}" for x in state.positions[:, point])
                raise ParameterError(
                    f"{int(bad.sum())} points of the body are inside obstacle {body.name!r} or "
                    f"nearer than {least:.2g} m to it, the first one at ({where}) m; "
                    "move the body or the obstacle, or take a smaller thickness"
                )

    def longest_step(self, state: State, dt: float) -> float:
        if any(sweep.surroundings is None for sweep in self._sweeps):
            self._refuse_inside(state, 0.0)
        longest = self._contact.max_step
        if dt <= longest:
            return dt
        places = self._touchable(state)
        for body, sweep, obstacle in zip(self._bodies, self._sweeps, state.obstacles, strict=True):
            arms = places - obstacle.position[:, None]
            turning = np.cross(obstacle.angular_velocity, arms, axisb=0).T
            velocities = obstacle.velocity[:, None] + turning
            way = dt * float(norms(state.velocities[:, self._points] - velocities).max(initial=0.0))
            if sweep.clearance(_into_frame(body, obstacle, places)) <= 2 * way + self._thickness:
                return longest
        return dt

    def project(self, before: State, after: State) -> State:
        h, bodies, places = after.time - before.time, self._bodies, self._touchable(before)
        pairs = list(zip(bodies, before.obstacles, strict=True))
        obstacles = [body.advance(obstacle, h) for body, obstacle in pairs]
        starts = [_into_frame(body, obstacle, places) for body, obstacle in pairs]
        for _ in range(_MOST_ROUNDS):
            stopped = 0
            for index, sweep in enumerate(self._sweeps):
                obstacle = obstacles[index]
                goals = _into_frame(bodies[index], obstacle, self._touchable(after))
                arrival = sweep(starts[index], goals)
                starts[index] = arrival.positions
                if arrival.stopped.size:
                    after, obstacles[index], starts[index] = self._strike(
                        index, arrival, after, obstacle
                    )
                    stopped += 1
            if stopped == 0 or len(obstacles) == 1:  # none pushes a point back into another
                return replace(after, obstacles=tuple(obstacles))
        after = replace(after, obstacles=tuple(obstacles))
        if self.clearance(after) <= 0:
            raise SqueezedError(after.time, [body.name for body in bodies])
        return after

    def _strike(
        self, index: int, arrival: Arrival, after: State, obstacle: RigidState
    ) -> tuple[State, RigidState, Floats]:
        """Let stopped points and the obstacle strike, and put the points where they got to.

        Friction takes back as much of their ways along the surface as of their velocities, so that
        what sticks stays. Also where all points are now, in the obstacle's frame.
        """
        body, points = self._bodies[index], self._points[arrival.stopped]
        positions, velocities = after.positions.copy(), after.velocities.copy()
        touching = Touching(
            self._masses[arrival.stopped],
            velocities[:, points],
            obstacle.rotation @ arrival.normals,
            _into_world(body, obstacle, arrival.positions[:, arrival.stopped])
            - obstacle.position[:, None],
            self._contact.friction,
        )
        struck = obstacle
        if body.motion == "free":
            velocities[:, points], grip, struck = strike_free(touching, body, obstacle)
        else:
            motion = np.concatenate([obstacle.velocity, obstacle.angular_velocity])
            velocities[:, points], grip = strike_fixed(touching, motion)
        places = self._sweeps[index].draw_back(arrival, grip)
        positions[:, points] = _into_world(body, obstacle, places[:, arrival.stopped])
        return replace(after, positions=positions, velocities=velocities), struck, places

    def clearance(self, state: State) -> float:
        places = self._touchable(state)
        return min(
            sweep.clearance(_into_frame(body, obstacle, places))
            for body, sweep, obstacle in zip(
                self._bodies, self._sweeps, state.obstacles, strict=True
            )
        )

    def _touchable(self, state: State) -> Floats:
        """Positions of the points that are not held, m, shape (3, k)."""
        return state.positions if self._all_free else state.positions[:, self._points]

    def get_state(self) -> object:
        return tuple(sweep.surroundings for sweep in self._sweeps)

    def set_state(self, state: object) -> None:
        for sweep, surroundings in zip(
            self._sweeps, cast("tuple[Surroundings | None, ...]", state), strict=True
        ):
            sweep.surroundings = surroundings


def _shape(body: RigidBody) -> Floats:
    """Points of a surface in the frame of its body, m, shape (m, 3)."""
    return body.points if body.moves else body.mesh.points


def _into_frame(body: RigidBody, obstacle: RigidState, positions: Floats) -> Floats:
    """Positions in the world in the frame of a rigid body, m, (3, k); the same if it is fixed."""
    if not body.moves:
        return positions
    return obstacle.rotation.T @ (positions - obstacle.position[:, None])


def _into_world(body: RigidBody, obstacle: RigidState, places: Floats) -> Floats:
    """Places in the frame of a rigid body in the world, m, shape (3, k)."""
    return obstacle.rotation @ places + obstacle.position[:, None] if body.moves else places
