"""How far points get on their ways before an obstacle stops them.

A point is kept at the distance `thickness` from the surface. Its distance from a mesh changes by no
more than it moves, so a known distance is a ball in which it is free, and no mesh is asked again
before it leaves that ball. Near the surface a point advances by half its known distance at a time
(the sphere tracing of Hart 1996), so that it cannot pass even the thinnest sheet, at any speed, and
which side it is on never has to be found out.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from softbody_core.configuration import norms
from softbody_core.contact.closest_point import ClosestPoint
from softbody_core.ground.arrays import Floats, Integers

_CLOSE: Final = 2.0
"""Distance over the thickness below which the surface is taken for a plane."""

_MARGIN: Final = 1.5
"""Distance over the thickness up to which a point is followed closely."""

_STALE: Final = 0.25
"""Way over the thickness, or over a smaller distance, after which a point looks again."""

_ROUNDING: Final = 1e-9
"""Part of the thickness by which a point at rest on an obstacle may seem to enter it."""

_STRETCHES: Final = 512
"""Parts of one way; a point that has not arrived then stays where it is."""


class Surroundings(NamedTuple):
    """What is known of each point's surroundings.

    Attributes
    ----------
    place : ndarray, shape (3, n)
        Where the point was when it looked, m.
    closest : ndarray, shape (3, n)
        Closest point of the surface, m; meaningless beyond `_CLOSE` thicknesses.
    distance : ndarray, shape (n,)
        Distance of the surface from there, m, or a lower bound beyond `_CLOSE` thicknesses.
    """

    place: Floats
    closest: Floats
    distance: Floats


class Arrival(NamedTuple):
    """Where points got to, and which of them an obstacle stopped.

    Attributes
    ----------
    positions : ndarray, shape (3, n)
        m.
    stopped : ndarray of int, shape (k,)
        Points that did not get to their goals.
    normals : ndarray, shape (3, k)
        Unit normals of the surface that stopped them; 0 for one that ran out of stretches.
    slid : ndarray, shape (3, k)
        Part of their ways that they made along the surface, m.
    """

    positions: Floats
    stopped: Integers
    normals: Floats
    slid: Floats


class Sweep:
    """Ways of n points past one mesh that stands still.

    Parameters
    ----------
    closest_point : ClosestPoint
        The mesh.
    thickness : float
        Distance to be kept, m.
    """

    def __init__(self, closest_point: ClosestPoint, thickness: float) -> None:
        self._closest_point = closest_point
        self._thickness = thickness
        self.surroundings: Surroundings | None = None
        """What is known so far. It decides results in the last digits, so it is state."""
        self._passed: tuple[Floats | None, float] = None, np.inf

    def clearance(self, positions: Floats) -> float:
        """Lower bound of the smallest distance between points and surface, m."""
        goal, clearance = self._passed
        if goal is positions:  # all points got there without meeting anything, as most times
            return clearance
        known = self._surroundings(positions)
        return float(np.min(known.distance - norms(positions - known.place), initial=np.inf))

    def __call__(self, start: Floats, goal: Floats) -> Arrival:
        """Carry points along straight ways, and along the surface where they meet it.

        Parameters
        ----------
        start, goal : ndarray, shape (3, n)
            Ends of the ways, m.
        """
        known = self._surroundings(start)
        left = known.distance - norms(goal - known.place)
        near = np.flatnonzero(~(left > _MARGIN * self._thickness))
        if near.size == 0:
            self._passed = goal, float(left.min(initial=np.inf))
            return Arrival(goal, near, np.empty((3, 0)), np.empty((3, 0)))
        positions = goal.copy()
        arrival = self._follow(near, start[:, near], goal[:, near])
        stopped = near[arrival.stopped]
        positions[:, stopped] = arrival.positions[:, arrival.stopped]
        return Arrival(positions, stopped, arrival.normals, arrival.slid)

    def draw_back(self, arrival: Arrival, share: Floats) -> Floats:
        """Positions, m, (3, n), after shares (k,) of the ways along the surface are taken back.

        Where the surface is curved, what lies between is looked at like any other way.
        """
        goal = arrival.positions.copy()
        goal[:, arrival.stopped] -= share * arrival.slid
        return self(arrival.positions, goal).positions

    def _follow(self, points: Integers, start: Floats, goal: Floats) -> Arrival:
        """Carry some of the points; the indices of the result count among them."""
        thickness = self._thickness
        reached, met_at, normals = start.copy(), goal.copy(), np.zeros_like(start)
        stopped = np.zeros(len(points), dtype=np.bool_)
        going = np.arange(len(points))
        positions, left = start, goal - start
        for _ in range(_STRETCHES):
            place, closest, distance = self._refreshed(points[going], positions)
            normal = (place - closest) / np.maximum(distance, np.finfo(float).tiny)
            room = np.einsum("ck,ck->k", normal, positions - closest) - thickness
            approach = np.einsum("ck,ck->k", normal, left)
            close = distance <= _CLOSE * thickness
            met = close & (approach < -room - _ROUNDING * thickness)
            first = going[met & ~stopped[going]]
            met_at[:, first] = reached[:, first]
            left = left + np.where(met, -room - approach, 0.0) * normal
            normals[:, going[met]] = normal[:, met]
            stopped[going[met]] = True
            clear = distance - norms(positions - place)
            free = np.where(close, clear / 2, clear - thickness)
            share = np.minimum(1.0, free / np.maximum(norms(left), np.finfo(float).tiny))
            positions = positions + share * left
            reached[:, going] = positions
            onward = share < 1
            left = ((1 - share) * left)[:, onward]
            positions, going = positions[:, onward], going[onward]
            if going.size == 0:
                break
        ended = stopped.copy()
        ended[going] = True
        slid = np.where(stopped, reached - met_at, 0.0)
        slid -= np.einsum("ck,ck->k", slid, normals) * normals
        return Arrival(reached, np.flatnonzero(ended), normals[:, ended], slid[:, ended])

    def _refreshed(self, points: Integers, positions: Floats) -> tuple[Floats, ...]:
        """Surroundings of some points, from no further than a part of the thickness."""
        known = self._surroundings(positions)
        moved = norms(positions - known.place[:, points])
        stale = moved > _STALE * np.minimum(known.distance[points], self._thickness)
        if stale.any():
            # those given out before stay as they were
            known = Surroundings(*(values.copy() for values in known))
            renewed, query = points[stale], self._query(positions[:, stale])
            known.place[:, renewed], known.closest[:, renewed], known.distance[renewed] = query
            self.surroundings = known
        return known.place[:, points], known.closest[:, points], known.distance[points]

    def _surroundings(self, positions: Floats) -> Surroundings:
        """What is known so far; at first, every point looks around."""
        if self.surroundings is None:
            self.surroundings = self._query(positions)
        return self.surroundings

    def _query(self, places: Floats) -> Surroundings:
        """Surroundings of places; far away, the distance from the mesh's box is enough."""
        distance = self._closest_point.distance_to_box(places)
        closest, near = places.copy(), distance <= _CLOSE * self._thickness
        if near.any():
            closest[:, near], distance[near] = self._closest_point(places[:, near])
        return Surroundings(places.copy(), closest, distance)
