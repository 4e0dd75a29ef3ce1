"""A sparse operator that bounds a model's stiffness and damping, factored once."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from softbody_core.ground.arrays import Floats
from softbody_core.integrators.integrator import Counters
from softbody_core.model import SoftBodyModel

_KEPT_FACTORIZATIONS = 8


class ConstantOperator:
    """m M + k K̄ + c C̄ over the free points, for any coefficients m, k, c.

    K̄ and C̄ are the weighted sums of the laws' majorants: constant, positive semi-definite, and
    alike for each component. So one factorization of an (n, n) matrix serves a set of coefficients
    for good, whatever the body does.

    Parameters
    ----------
    model : SoftBodyModel
        Forces and masses.
    counters : Counters
        Where solutions are counted.
    """

    def __init__(self, model: SoftBodyModel, counters: Counters) -> None:
        self._counters = counters
        self._masses = model.masses
        self._free = model.inverse_masses > 0
        n = model.mesh.n_points
        self.stiffness, self.damping = sp.csr_array((n, n)), sp.csr_array((n, n))
        for weight, law in model.terms:
            stiffness, damping = law.majorants()
            if stiffness is not None:
                self.stiffness = self.stiffness + weight * stiffness
            if damping is not None:
                self.damping = self.damping + weight * damping
        self._factors: OrderedDict[tuple[float, float, float], Any] = OrderedDict()

    def solve(self, coefficients: tuple[float, float, float], right_hand_side: Floats) -> Floats:
        """Solution for a right-hand side of shape (3, n) or (6, n), …; zero at held points."""
        self._counters.linear_solves += len(right_hand_side) // 3
        solution = np.zeros_like(right_hand_side)
        factor = self._factor(coefficients)
        solution[:, self._free] = factor.solve(right_hand_side[:, self._free].T).T
        return solution

    def _factor(self, coefficients: tuple[float, float, float]) -> Any:
        if coefficients in self._factors:
            self._factors.move_to_end(coefficients)
            return self._factors[coefficients]
        m, k, c = coefficients
        matrix = m * sp.diags_array(self._masses) + k * self.stiffness + c * self.damping
        matrix = sp.csc_array(matrix)[self._free][:, self._free]
        factor = scipy.sparse.linalg.splu(
            sp.csc_matrix(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        self._factors[coefficients] = factor
        if len(self._factors) > _KEPT_FACTORIZATIONS:
            self._factors.popitem(last=False)
        return factor
