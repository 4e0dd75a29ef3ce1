"""The order at which something converges with the number of points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar


def convergence_order(points: Sequence[int], changes: Sequence[float]) -> float:
    """Order p at which changes from mesh to mesh follow hᵢᵖ − hᵢ₊₁ᵖ, with h = points^(−1/2).

    Parameters
    ----------
    points : sequence of int
        Sizes, coarse to fine.
    changes : sequence of float
        From each mesh to the next one, positive.

    Returns
    -------
    float
        By least squares of the logarithms; NaN of fewer than three meshes.
    """
    if len(changes) < 2 or not np.all(np.asarray(changes) > 0):
        return float("nan")
    h = np.asarray(points, float) ** -0.5

    def misfit(order: float) -> float:
        powers = h**order
        return float(np.var(np.log(changes) - np.log(powers[:-1] - powers[1:])))

    return float(minimize_scalar(misfit, bounds=(0.05, 8.0), method="bounded").x)
