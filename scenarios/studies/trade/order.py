"""The order at which something converges with the width of a mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar


def convergence_order(widths: ArrayLike, changes: Sequence[float]) -> float:
    """Order p at which changes from mesh to mesh follow hᵢᵖ − hᵢ₊₁ᵖ.

    Parameters
    ----------
    widths : array_like
        h of each mesh, coarse to fine.
    changes : sequence of float
        From each mesh to the next one, positive.

    Returns
    -------
    float
        By least squares of the logarithms; NaN of fewer than three meshes.
    """
    if len(changes) < 2 or not np.all(np.asarray(changes) > 0):
        return float("nan")
    h = np.asarray(widths, float)

    def misfit(order: float) -> float:
        powers = h**order
        return float(np.var(np.log(changes) - np.log(powers[:-1] - powers[1:])))

    return float(minimize_scalar(misfit, bounds=(0.05, 8.0), method="bounded").x)
