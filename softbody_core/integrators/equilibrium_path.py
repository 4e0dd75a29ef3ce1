"""A path through the shapes at rest, which remembers where it has been."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softbody_core.ground.arrays import Floats
from softbody_core.integrators.equilibrium_solver import (
    Balance,
    EquilibriumPoint,
    EquilibriumSolver,
)

_SAME_RECOIL = 1e-3
"""Difference of the recoil, over its scale, that is overlooked."""
_SAME_SHAPE = 0.01
"""Distance of the points (root mean square), over the cube root of the volume, likewise."""


class PathState(NamedTuple):
    """Where a path stands and what it remembers. Nothing in it changes later.

    Attributes
    ----------
    below, above : EquilibriumPoint
        The shapes on both sides of the body's volume.
    following : dict
        The shape that follows from another as the volume rises (1) or falls (−1).
    """

    below: EquilibriumPoint
    above: EquilibriumPoint
    following: dict[tuple[EquilibriumPoint, int], EquilibriumPoint]


class EquilibriumPath:
    """Follows the shapes at rest as a volume rises and falls.

    A shape that follows from another is worked out once. If it is nearly one that is known, it is
    taken to be that one, so a body that breathes regularly soon works out nothing any more.

    Parameters
    ----------
    solver : EquilibriumSolver
        Finds what follows.
    """

    def __init__(self, solver: EquilibriumSolver) -> None:
        self._solver = solver
        self._below = self._rest = solver.rest()
        self._following: dict[tuple[EquilibriumPoint, int], EquilibriumPoint] = {}
        self._above = self._follow(self._below, 1)

    def balance(self, volume: float) -> Balance:
        """Recoil, drag and volumes that the path leads to at a volume, m³."""
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
        return below.positions + share * outward, outward / (self._solver.spacing * volume)

    def get_state(self) -> PathState:
        """Everything that decides what the path does next."""
        return PathState(self._below, self._above, dict(self._following))

    def set_state(self, state: PathState) -> None:
        """Go back to what `get_state` returned."""
        self._below, self._above = state.below, state.above
        self._following = dict(state.following)

    def _share(self, below: EquilibriumPoint, volume: float) -> float:
        return math.log(volume / self._solver.volume(below.index)) / self._solver.spacing

    def _ahead(self, volume: float) -> tuple[EquilibriumPoint, EquilibriumPoint]:
        """Shapes on both sides of a volume, as met on the way there from where the path stands."""
        below, above = self._below, self._above
        while volume > self._solver.volume(above.index):
            below, above = above, self._follow(above, 1)
        while volume < self._solver.volume(below.index):
            below, above = self._follow(below, -1), below
        return below, above

    def _follow(self, point: EquilibriumPoint, step: int) -> EquilibriumPoint:
        if (point, step) not in self._following:
            new = self._solver.next(point, step)
            known = [self._rest, *self._following.values()]
            alike = (old for old in known if old.index == new.index and self._alike(old, new))
            self._following[point, step] = next(alike, new)
        return self._following[point, step]

    def _alike(self, old: EquilibriumPoint, new: EquilibriumPoint) -> bool:
        if abs(old.balance.recoil - new.balance.recoil) > _SAME_RECOIL * self._solver.scale:
            return False
        distance = math.sqrt(3 * np.mean((old.positions - new.positions) ** 2))
        return distance <= _SAME_SHAPE * float(np.cbrt(self._solver.volume(old.index)))
