"""The equation that every implicit integrator solves, by a quasi-Newton iteration.

M (v − v*) = z F(x* + z v, v), with x*, v* and z given by the integrator. The iteration matrix is
M + z² K̄ + z C̄ plus the rank-one parts of the laws along ∂V/∂x. K̄ and C̄ are constant and positive
semi-definite, act on each component alike, and are at least the springs' stiffness and damping in
every configuration (Baraff & Witkin 1998 make the exact matrix definite instead, and have to
factor it anew each step). So one factorization of an (n, n) matrix serves a step size for good, and
the rank-one parts follow by the Sherman-Morrison-Woodbury formula. Where the surface yields easily
across itself, the bound is far from the stiffness, and Anderson acceleration halves the iterations.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.forces.volume_law import RankOne
from softbody_core.ground.anderson import Anderson
from softbody_core.ground.arrays import Floats
from softbody_core.integrators.constant_operator import ConstantOperator
from softbody_core.integrators.integrator import Counters
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs

_MEMORY = 5


class Stage(NamedTuple):
    """Solution of the equation; its configuration holds until the next solution."""

    positions: Floats
    velocities: Floats
    configuration: Configuration
    converged: bool


class Linearization:
    """The iteration matrix at one configuration: P + Σ cᵢ lᵢ rᵢᵀ, ready to be solved with.

    Parameters
    ----------
    z : float
        The equation's z, s.
    base : callable
        Solves with P for a right-hand side of shape (3, n).
    parts : list of RankOne
        The others.
    """

    def __init__(self, z: float, base: Callable[[Floats], Floats], parts: list[RankOne]) -> None:
        self.z = z
        self._base = base
        self._parts = [part for part in parts if part.coefficient != 0]
        if not self._parts:
            return
        # Gas and airway share the volume gradient as their left vector: solve for it once.
        lefts = {id(part.left): part.left for part in self._parts}
        solved_for = {key: base(left) for key, left in lefts.items()}
        self._solved = [solved_for[id(part.left)] for part in self._parts]
        coupling = [
            [np.vdot(part.right, solved) for solved in self._solved] for part in self._parts
        ]
        self._small = np.diag([1 / part.coefficient for part in self._parts]) + np.array(coupling)

    def solve(self, right_hand_side: Floats) -> Floats:
        """Solution for a right-hand side of shape (3, n); zero at held points."""
        solution = self._base(right_hand_side)
        if self._parts:
            projected = [np.vdot(part.right, solution) for part in self._parts]
            for weight, solved in zip(
                np.linalg.solve(self._small, projected), self._solved, strict=True
            ):
                solution -= weight * solved
        return solution


class QuasiNewton:
    """Solver for one model.

    Parameters
    ----------
    model : SoftBodyModel
        Forces and masses.
    max_iterations : int
        Iterations after which a stage counts as not converged.
    counters : Counters
        Where evaluations and solutions are counted.
    """

    def __init__(self, model: SoftBodyModel, max_iterations: int, counters: Counters) -> None:
        self._counters = counters
        self._model = model
        self._max_iterations = max_iterations
        self._operator = ConstantOperator(model, counters)
        self._configuration = Configuration(model.mesh, np.ascontiguousarray(model.mesh.points.T))

    def solve(
        self,
        base_positions: Floats,
        base_velocities: Floats,
        guess: Floats,
        linearization: Linearization,
        inputs: Inputs,
        tolerance: float,
    ) -> Stage:
        """Find v, and x = x* + z v.

        Parameters
        ----------
        base_positions, base_velocities : ndarray, shape (3, n)
            x*, m, and v*, m/s.
        guess : ndarray, shape (3, n)
            Where to start, m/s.
        linearization : Linearization
            Iteration matrix; it holds z.
        inputs : Inputs
            Held.
        tolerance : float
            Root-mean-square change of the positions in the last iteration, m.
        """
        model, z, configuration = self._model, linearization.z, self._configuration
        velocities, last_change, converged = guess, np.inf, False
        accelerate = Anderson(_MEMORY)
        for _ in range(self._max_iterations):
            configuration.move_to(base_positions + z * velocities)
            self._counters.force_evaluations += 1
            residual = z * model.total_force(configuration, velocities, inputs)
            residual -= model.masses * (velocities - base_velocities)
            correction = linearization.solve(residual)
            velocities = accelerate.next(velocities, correction)
            change = z * float(np.sqrt(np.mean(correction**2) * 3))
            if not np.isfinite(change) or change > 10 * last_change:
                break
            converged = change <= tolerance
            if converged:
                break
            last_change = change
        configuration.move_to(base_positions + z * velocities)
        return Stage(configuration.positions, velocities, configuration, converged)

    def linearize(
        self, positions: Floats, velocities: Floats, z: float, inputs: Inputs
    ) -> Linearization:
        """Iteration matrix at positions, m, and velocities, m/s, for an equation's z, s."""
        configuration = self._configuration
        configuration.move_to(positions)
        parts = [
            part._replace(coefficient=z * z * weight * part.coefficient)
            for weight, law in self._model.pressures
            for part in law.rank_one_stiffness(configuration, inputs)
            if part.coefficient > 0  # one that softens would leave the matrix indefinite
        ]
        for weight, law in self._model.resistances:
            part = law.rank_one_damping(configuration, velocities)
            parts.append(part._replace(coefficient=z * weight * part.coefficient))
        return Linearization(z, lambda b: self._operator.solve((1.0, z * z, z), b), parts)
