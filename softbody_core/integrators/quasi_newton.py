"""The equation that every implicit scheme solves, by a quasi-Newton iteration.

M (v − v*) = z F(x* + z v, v), with x*, v* and z given by the scheme. The iteration matrix is
M + z² K̄ + z C̄ plus the rank-one parts of gas and airway. K̄ and C̄ are constant and positive
semi-definite, act on each component alike, and are at least the springs' stiffness and damping in
every configuration (Baraff & Witkin 1998 make the exact matrix definite instead, and have to
factor it anew each step). So one factorization of an (n, n) matrix serves a step size for good, and
the rank-one parts follow by the Sherman-Morrison-Woodbury formula.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg
from numpy.typing import NDArray

from softbody_core.configuration import Configuration
from softbody_core.forces.force import RankOne
from softbody_core.integrators.integrator import Work
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs

Floats = NDArray[np.float64]

_KEPT_FACTORIZATIONS = 8


class Stage(NamedTuple):
    """Solution of the equation, and how it was reached."""

    positions: Floats
    velocities: Floats
    configuration: Configuration
    converged: bool


class Linearization:
    """The iteration matrix at one configuration: P + Σ cᵢ lᵢ rᵢᵀ, ready to be solved with."""

    def __init__(
        self, factor: Any, free: NDArray[np.bool_], parts: list[RankOne], work: Work
    ) -> None:
        self._work = work
        self._factor = factor
        self._free = free
        self._parts = [part for part in parts if part.coefficient != 0]
        if not self._parts:
            return
        # Gas and airway share the volume gradient as their left vector: solve for it once.
        lefts = {id(part.left): part.left for part in self._parts}
        solved_for = {key: self._base(left) for key, left in lefts.items()}
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

    def _base(self, right_hand_side: Floats) -> Floats:
        self._work.linear_solves += 1
        solution = np.zeros_like(right_hand_side)
        solution[:, self._free] = self._factor.solve(right_hand_side[:, self._free].T).T
        return solution


class QuasiNewton:
    """Solver for one model.

    Parameters
    ----------
    model : SoftBodyModel
        Forces and masses.
    max_iterations : int
        Iterations after which a stage counts as not converged.
    work : Work
        Where evaluations and solutions are counted.
    """

    def __init__(self, model: SoftBodyModel, max_iterations: int, work: Work) -> None:
        self._work = work
        self._model = model
        self._max_iterations = max_iterations
        self._free = model.inverse_masses > 0
        n = model.mesh.n_points
        self._stiffness, self._damping = sp.csr_array((n, n)), sp.csr_array((n, n))
        for weight, term in model.terms:
            operators = term.bounding_operators()
            if operators is not None:
                self._stiffness = self._stiffness + weight * operators[0]
                self._damping = self._damping + weight * operators[1]
        self._factors: OrderedDict[float, Any] = OrderedDict()

    def solve(
        self,
        base_positions: Floats,
        base_velocities: Floats,
        guess: Floats,
        z: float,
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
        z : float
            s.
        inputs : Inputs
            Held.
        tolerance : float
            Root-mean-square change of the positions in the last iteration, m.
        """
        model, velocities = self._model, guess
        linearization: Linearization | None = None
        last_change = np.inf
        for _ in range(self._max_iterations):
            positions = base_positions + z * velocities
            configuration = Configuration(model.mesh, positions)
            self._work.force_evaluations += 1
            residual = z * model.total_force(configuration, velocities, inputs)
            residual -= model.masses * (velocities - base_velocities)
            if linearization is None:
                linearization = self.linearize(configuration, z, inputs)
            correction = linearization.solve(residual)
            velocities = velocities + correction
            change = z * float(np.sqrt(np.mean(correction**2) * 3))
            if not np.isfinite(change) or change > 10 * last_change:
                break
            if change <= tolerance:
                positions = base_positions + z * velocities
                return Stage(positions, velocities, Configuration(model.mesh, positions), True)
            last_change = change
        return Stage(positions, velocities, configuration, False)

    def linearize(self, configuration: Configuration, z: float, inputs: Inputs) -> Linearization:
        """Iteration matrix at a configuration."""
        parts = [
            part._replace(coefficient=z * z * weight * part.coefficient)
            for weight, term in self._model.terms
            for part in term.rank_one_stiffness(configuration, inputs)
        ]
        if self._model.airway is not None:
            parts += [
                part._replace(coefficient=z * part.coefficient)
                for part in self._model.airway.rank_one_damping(configuration)
            ]
        return Linearization(self._factor(z), self._free, parts, self._work)

    def _factor(self, z: float) -> Any:
        """Factorization of M + z² K̄ + z C̄ over the free points."""
        if z in self._factors:
            self._factors.move_to_end(z)
            return self._factors[z]
        matrix = sp.diags_array(self._model.masses) + z * z * self._stiffness + z * self._damping
        matrix = sp.csc_array(matrix)[self._free][:, self._free]
        factor = scipy.sparse.linalg.splu(
            sp.csc_matrix(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        self._factors[z] = factor
        if len(self._factors) > _KEPT_FACTORIZATIONS:
            self._factors.popitem(last=False)
        return factor
