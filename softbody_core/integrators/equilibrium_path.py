"""A path through the shapes at rest, which remembers where it has been."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softbody_core.ground.arrays import Floats
from softbody_core.integrators.equilibrium import Balance, Shapes, Station

_SAME_RECOIL = 1e-3
"""Difference of the recoil, over its scale, that is overlooked."""
_SAME_SHAPE = 0.01
"""Distance of the points (root mean square), over the cube root of the volume, likewise."""


class Trail(NamedTuple):
    """Where a path stands and what it remembers. Nothing in it changes later.

    Attributes
    ----------
    below, above : Station
        The shapes on both sides of the body's volume.
    following : dict
        The shape that follows from another as the volume rises (1) or falls (−1).
    """

    below: Station
    above: Station
    following: dict[tuple[Station, int], Station]


class EquilibriumPath:
    """Follows the shapes at rest as a volume rises and falls.

    A shape that follows from another is worked out once. If it is nearly one that is known, it is
    taken to be that one, so a body that breathes regularly soon works out nothing any more.

    Parameters
    ----------
    shapes : Shapes
        Finds what follows.
    """

    def __init__(self, shapes: Shapes) -> None:
        self._shapes = shapes
        self._below = self._rest = shapes.rest()
        self._following: dict[tuple[Station, int], Station] = {}
        self._above = self._follow(self._below, 1)

    def balance(self, volume: float) -> Balance:
        """Recoil, drag and gas volume that the path leads to at a volume, m³."""
        below, above = self._ahead(volume)
        share = self._share(below, volume)
        ends = zip(below.balance, above.balance, strict=True)
        return Balance(*((1 - share) * low + share * high for low, high in ends))

    def go_to(self, volume: float) -> None:
        """Let the path lead to a volume, m³."""
        self._below, self._above = self._ahead(volume)

    def shape(self, volume: float) -> tuple[Floats, Floats]:
        """Positions x, m, and dx/dV, 1/m², at a volume, m³; both of shape (3, n)."""
        below, above = self._ahead(volume)
        share = self._share(below, volume)
        outward = above.positions - below.positions
        return below.positions + share * outward, outward / (self._shapes.spacing * volume)

    def trail(self) -> Trail:
        """Everything that decides what the path does next."""
        return Trail(self._below, self._above, dict(self._following))

    def take(self, trail: Trail) -> None:
        """Go back to an earlier trail."""
        self._below, self._above = trail.below, trail.above
        self._following = dict(trail.following)

    def _share(self, below: Station, volume: float) -> float:
        return math.log(volume / self._shapes.volume(below.index)) / self._shapes.spacing

    def _ahead(self, volume: float) -> tuple[Station, Station]:
        """Shapes on both sides of a volume, as met on the way there from where the path stands."""
        below, above = self._below, self._above
        while volume > self._shapes.volume(above.index):
            below, above = above, self._follow(above, 1)
        while volume < self._shapes.volume(below.index):
            below, above = self._follow(below, -1), below
        return below, above

    def _follow(self, station: Station, step: int) -> Station:
        if (station, step) not in self._following:
            found = self._shapes.next(station, step)
            known = [self._rest, *self._following.values()]
            alike = (one for one in known if one.index == found.index and self._alike(one, found))
            self._following[station, step] = next(alike, found)
        return self._following[station, step]

    def _alike(self, one: Station, other: Station) -> bool:
        if abs(one.balance.recoil - other.balance.recoil) > _SAME_RECOIL * self._shapes.scale:
            return False
        distance = math.sqrt(3 * np.mean((one.positions - other.positions) ** 2))
        return distance <= _SAME_SHAPE * float(np.cbrt(self._shapes.volume(one.index)))
