"""Contact of a soft body's points with rigid bodies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Final, cast

import numpy as np

from softbody_core.configuration import norms
from softbody_core.constraints.constraint import Constraint, Projection
from softbody_core.contact.closest_point import ClosestPoint
from softbody_core.contact.impulses import Touching, strike_fixed, strike_free
from softbody_core.contact.sweep import Look, Reached, Sweep
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
    """Points do not enter rigid bodies; friction slows them along the walls.

    After each inner step, ways that end in a wall, or beyond it, are cut short there, and the
    velocities of points that touch are corrected by impulses. The walls act on points, not on the
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

    def __init__(self, law: Contact, mesh: SurfaceMesh, masses: Floats, free: Booleans) -> None:
        self._law = law
        self._points = np.flatnonzero(free)
        self._all_free = bool(free.all())
        self._masses = masses[self._points]
        thickness = law.thickness
        self._thickness = 0.1 * float(mesh.edge_lengths.mean()) if thickness is None else thickness
        self._walls = [ClosestPoint(_shape(body), body.mesh.triangles) for body in law.bodies]
        self._sweeps = [Sweep(wall, self._thickness) for wall in self._walls]

    def start(self, state: State) -> State:
        """Put the obstacles where they stand at time 0.

        Raises
        ------
        ParameterError
            If a point of the body is inside an obstacle, or touches it.
        """
        started = replace(state, obstacles=tuple(body.start() for body in self._law.bodies))
        self._refuse(started, self._thickness)
        return started

    def _refuse(self, state: State, least: float) -> None:
        """Raise for points inside an obstacle, or nearer than `least` to it, m."""
        for body, there, wall in zip(self._law.bodies, state.obstacles, self._walls, strict=True):
            seen = _from(body, there, self._touchable(state))
            near = wall.distance_to_box(seen) <= least
            if not near.any():
                continue
            _, distance = wall(seen[:, near])
            bad = wall.inside(seen[:, near]) | (distance < least)
            if bad.any():
                point = self._points[near][bad][0]
                where = ", ".join(f"{x:.4g}" for x in state.positions[:, point])
                raise ParameterError(
                    f"{int(bad.sum())} points of the body are inside obstacle {body.name!r} or "
                    f"nearer than {least:.2g} m to it, the first one at ({where}) m; "
                    "move the body or the obstacle, or take a smaller thickness"
                )

    def longest_step(self, state: State, dt: float) -> float:
        if any(sweep.look is None for sweep in self._sweeps):
            self._refuse(state, 0.0)
        longest = self._law.max_step
        if dt <= longest:
            return dt
        for body, sweep, there in zip(self._law.bodies, self._sweeps, state.obstacles, strict=True):
            places = self._touchable(state)
            arms = places - there.position[:, None]
            wall = there.velocity[:, None] + np.cross(there.angular_velocity, arms, axisb=0).T
            way = dt * float(norms(state.velocities[:, self._points] - wall).max(initial=0.0))
            if sweep.clearance(_from(body, there, places)) <= 2 * way + self._thickness:
                return longest
        return dt

    def project(self, before: State, after: State) -> State:
        h = after.time - before.time
        obstacles = [
            body.advance(there, h)
            for body, there in zip(self._law.bodies, before.obstacles, strict=True)
        ]
        bodies, seen = self._law.bodies, self._touchable(before)
        starts = [
            _from(body, there, seen) for body, there in zip(bodies, before.obstacles, strict=True)
        ]
        for _ in range(_MOST_ROUNDS):
            stopped = 0
            for index in range(len(obstacles)):
                here, sweep = obstacles[index], self._sweeps[index]
                goals = _from(bodies[index], here, self._touchable(after))
                reached = sweep(starts[index], goals)
                starts[index] = reached.positions
                if reached.stopped.size:
                    after, obstacles[index], starts[index] = self._strike(
                        index, reached, after, here
                    )
                    stopped += 1
            if stopped == 0 or len(obstacles) == 1:  # no wall pushes a point back into another
                return replace(after, obstacles=tuple(obstacles))
        after = replace(after, obstacles=tuple(obstacles))
        if self.clearance(after) <= 0:
            raise SqueezedError(after.time, [body.name for body in self._law.bodies])
        return after

    def _strike(
        self, index: int, reached: Reached, after: State, here: RigidState
    ) -> tuple[State, RigidState, Floats]:
        """Let stopped points and the obstacle strike, and put the points where they got to.

        Friction takes back as much of their ways along the wall as of their velocities, so that
        what sticks stays. Also where points are now, seen from the obstacle.
        """
        body, points = self._law.bodies[index], self._points[reached.stopped]
        positions, velocities = after.positions.copy(), after.velocities.copy()
        touching = Touching(
            self._masses[reached.stopped],
            velocities[:, points],
            here.rotation @ reached.normals,
            _to(body, here, reached.positions[:, reached.stopped]) - here.position[:, None],
            self._law.friction,
        )
        struck = here
        if body.motion == "free":
            velocities[:, points], grip, struck = strike_free(touching, body, here)
        else:
            motion = np.concatenate([here.velocity, here.angular_velocity])
            velocities[:, points], grip = strike_fixed(touching, motion)
        seen = self._sweeps[index].draw_back(reached, grip)
        positions[:, points] = _to(body, here, seen[:, reached.stopped])
        return replace(after, positions=positions, velocities=velocities), struck, seen

    def clearance(self, state: State) -> float:
        return min(
            sweep.clearance(_from(body, there, self._touchable(state)))
            for body, sweep, there in zip(
                self._law.bodies, self._sweeps, state.obstacles, strict=True
            )
        )

    def _touchable(self, state: State) -> Floats:
        """Positions of the points that are not held, m, shape (3, k)."""
        return state.positions if self._all_free else state.positions[:, self._points]

    def get_state(self) -> object:
        return tuple(sweep.look for sweep in self._sweeps)

    def set_state(self, state: object) -> None:
        looks = cast("tuple[Look | None, ...]", state)
        for sweep, look in zip(self._sweeps, looks, strict=True):
            sweep.look = look


def _shape(body: RigidBody) -> Floats:
    """Points of a surface as positions are seen from it, m, shape (m, 3)."""
    return body.points if body.moves else body.mesh.points


def _from(body: RigidBody, there: RigidState, positions: Floats) -> Floats:
    """Positions in the world seen from a rigid body, m, shape (3, k); the same if it is fixed."""
    if not body.moves:
        return positions
    return there.rotation.T @ (positions - there.position[:, None])


def _to(body: RigidBody, there: RigidState, seen: Floats) -> Floats:
    """Positions in the world of what is seen from a rigid body, m, shape (3, k)."""
    return there.rotation @ seen + there.position[:, None] if body.moves else seen
