"""The shapes that a body takes at rest as its volume rises and falls.

At rest the forces that shape the surface balance a uniform pressure: F(x) + p ∂V/∂x = 0. So to a
volume belong a shape x, an elastic recoil p, and what the dampers resist, whatever the laws along
∂V/∂x, ΔP and N are. There may be
several such shapes: a surface that has folded out may not fold in again on the same way back. So
shapes follow from each other, as points on a path, and a path once gone is remembered.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.ground.anderson import Anderson
from softbody_core.ground.arrays import Floats
from softbody_core.ground.errors import ParameterError
from softbody_core.integrators.constant_operator import ConstantOperator
from softbody_core.integrators.integrator import Counters
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs

_MEMORY = 8
_STILL = 1e-9
"""Mass term in the iteration matrix, as a share of its stiffness: it keeps a free body in place."""
_UNBALANCED = 1e-6
"""Resultant of the forces on a free body at rest, as a share of their sum, that counts as one."""


class Balance(NamedTuple):
    """What a body at rest does at one volume.

    Attributes
    ----------
    recoil : float
        p, Pa.
    drag : float
        Pressure that the dampers add per flow, Pa·s/m³.
    volume, bounding_box_volume : float
        Volumes that pressures depend on, V and B, m³.
    """

    recoil: float
    drag: float
    volume: float
    bounding_box_volume: float


@dataclass(frozen=True, eq=False)
class EquilibriumPoint:
    """One shape at rest.

    Attributes
    ----------
    index : int
        Its volume is V₀ exp(index · spacing).
    positions : ndarray, shape (3, n)
        m.
    outward : ndarray, shape (3, n)
        Move that adds to the volume, along the path by which the shape was reached, m.
    balance : Balance
        Recoil, drag, volumes.
    """

    index: int
    positions: Floats
    outward: Floats
    balance: Balance


class EquilibriumSolver:
    """Finds the shape at rest that follows from another.

    The iteration uses the constant operator of the springs and Anderson acceleration.

    Parameters
    ----------
    model : SoftBodyModel
        Forces; they must be able to balance at rest.
    spacing : float
        Logarithm of the ratio of neighbouring volumes.
    tolerance : float
        Change of the recoil in one iteration that ends it, over the recoil by which the springs'
        operator would resist a doubled volume.
    max_iterations : int
        Iterations for one shape. Directions in which the surface is all but free to move converge
        slowly, and matter little to the recoil: an iteration that ends here is accepted.
    counters : Counters
        Where evaluations and solutions are counted.

    Raises
    ------
    ParameterError
        If nothing holds the surface together, or forces move a body that nothing holds in place.
    """

    def __init__(
        self,
        model: SoftBodyModel,
        spacing: float,
        tolerance: float,
        max_iterations: int,
        counters: Counters,
    ) -> None:
        self._model, self._shaping = model, model.without_pressures()
        self.spacing = spacing
        self._max_iterations = max_iterations
        self._counters = counters
        self._operator = ConstantOperator(model, counters)
        stiffness = float(self._operator.stiffness.diagonal().mean())
        if stiffness == 0:
            raise ParameterError(
                "quasi-static needs a law that holds the surface together: add mass_spring with a "
                "positive stiffness, or choose another integrator"
            )
        self._coefficients = (_STILL * stiffness / float(model.masses.mean()), 1.0, 0.0)
        rest = np.ascontiguousarray(model.mesh.points.T)
        self._still = np.zeros_like(rest)
        self._configuration = Configuration(model.mesh, rest)
        self._refuse_what_falls()
        area = self._configuration.volume_gradient
        yielding = self._operator.solve(self._coefficients, area)
        self.scale = model.mesh.volume / float(np.vdot(area, yielding))
        self.accuracy = tolerance * self.scale
        self._swelling = yielding

    def volume(self, index: int) -> float:
        """Volume of a point, m³."""
        return self._model.mesh.volume * math.exp(index * self.spacing)

    def rest(self) -> EquilibriumPoint:
        """Shape at rest at the volume of the mesh."""
        start = np.ascontiguousarray(self._model.mesh.points.T)
        guessed = self._settle(0, start, self._swelling, start)
        above = self.next(guessed, 1)
        return self._measured(0, guessed.positions, above.positions - guessed.positions)

    def next(self, point: EquilibriumPoint, step: int) -> EquilibriumPoint:
        """Shape that follows when the volume rises (step = 1) or falls (step = −1)."""
        index = point.index + step
        self._configuration.move_to(point.positions)
        gain = float(np.vdot(self._configuration.volume_gradient, point.outward))
        move = point.outward * ((self.volume(index) - self._configuration.volume) / gain)
        return self._settle(index, point.positions, move, point.positions + move)

    def _settle(self, index: int, start: Floats, move: Floats, x: Floats) -> EquilibriumPoint:
        """Iterate from x, where a move along the path has led from `start`."""
        volume, arriving = self.volume(index), x is not start
        accelerate, recoil = Anderson(_MEMORY), math.inf
        for _ in range(self._max_iterations):
            self._configuration.move_to(x)
            force, area = self._force(self._still), self._configuration.volume_gradient
            # For a virtual move along the path, the error of the recoil is of second order.
            last, recoil = recoil, -float(np.vdot(force, move) / np.vdot(area, move))
            if abs(recoil - last) <= self.accuracy:
                break
            solved = self._operator.solve(self._coefficients, np.concatenate([force, area]))
            gap = volume - self._configuration.volume - float(np.vdot(area, solved[:3]))
            correction = solved[:3] + solved[3:] * (gap / float(np.vdot(area, solved[3:])))
            x = accelerate.next(x, correction)
            if arriving:
                move = x - start
        return self._measured(index, x, move)

    def _measured(self, index: int, x: Floats, move: Floats) -> EquilibriumPoint:
        """Say what a shape does when its volume changes along a move, m, shape (3, n)."""
        self._configuration.move_to(x)
        gain = float(np.vdot(self._configuration.volume_gradient, move))
        slope = move / gain
        force = self._force(self._still)
        recoil = -float(np.vdot(force, slope))
        drag = float(np.vdot(force - self._force(slope), slope))
        volumes = self._configuration.volume, self._configuration.bounding_box_volume
        balance = Balance(recoil, drag, *volumes)
        return EquilibriumPoint(index, x, move * math.copysign(1.0, gain), balance)

    def _force(self, velocities: Floats) -> Floats:
        """Force of the laws that shape the surface, N, where it stands."""
        self._counters.force_evaluations += 1
        return self._shaping.force(self._configuration, velocities, Inputs())

    def _refuse_what_falls(self) -> None:
        if (self._model.inverse_masses == 0).any():
            return
        force = self._force(self._still)
        resultant = float(np.linalg.norm(force.sum(axis=1)))
        if resultant > _UNBALANCED * float(np.abs(force).sum()) and resultant > 0:
            raise ParameterError(
                f"quasi-static needs a body at rest, but nothing holds this one against a force of "
                f"{resultant:.3g} N; pin it (constraints), set the weight of gravity delta = 0, or "
                "choose another integrator"
            )
