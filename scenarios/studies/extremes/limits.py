"""Measured stability limits of the explicit schemes, beside 2/√λ_max."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg
import xarray as xr

from scenarios.studies.extremes.cases import Case
from softbody_core import INTEGRATORS, MassSpring, SoftBody, SoftBodyModel
from softbody_core.errors import DivergenceError
from softbody_core.integrators import Integrator
from softbody_core.integrators.explicit import ExplicitIntegrator

Scheme = Callable[..., Integrator]

_STIFFNESSES: Final = (1e-3, 1.0, 1e3, 1e6, 1e9)
_SUBSTEPS: Final = 50
_ROUNDS: Final = 8
_GROWTH: Final = 1e4
"""Growth of the velocities that counts as unstable. At the limit they grow with the number of
substeps, to some hundreds; a hundredth beyond it they double every ten substeps or faster."""

_RESOLVED: Final = 1.005


def stability_limits(case: Case, *, reduced: bool = False) -> xr.Dataset:
    """Measure the largest stable step of each explicit scheme on the bare spring network.

    Parameters
    ----------
    case : Case
        Whose surface, mass and α are taken; its other laws are left out, and its damping is 0.
    reduced : bool
        Take one stiffness.

    Returns
    -------
    xarray.Dataset
        `measured_limit` and `estimated_limit` (scheme, spring_stiffness), s; `two_over_omega`
        (spring_stiffness), s: 2/√λ_max of M⁻¹K at rest, K the springs' own stiffness matrix.
    """
    stiffnesses = (1e3,) if reduced else _STIFFNESSES
    schemes = explicit_schemes()
    models = [bare_springs(case, stiffness) for stiffness in stiffnesses]
    exact = [2 / math.sqrt(largest_eigenvalue(model)) for model in models]
    pairs = list(zip(models, exact, strict=True))
    measured = [[measured_limit(kind, *pair) for pair in pairs] for kind in schemes.values()]
    estimated = [[_estimated(kind, *pair) for pair in pairs] for kind in schemes.values()]
    both = ("scheme", "spring_stiffness")

    def attributes(name: str) -> dict[str, str]:
        return {"units": "s", "long_name": name}

    return xr.Dataset(
        {
            "measured_limit": (both, measured, attributes("largest stable step, measured")),
            "estimated_limit": (
                both,
                estimated,
                attributes("largest stable step by the scheme itself"),
            ),
            "two_over_omega": ("spring_stiffness", exact, attributes("2/√λ_max of the springs")),
        },
        coords={
            "scheme": list(schemes),
            "spring_stiffness": (
                "spring_stiffness",
                list(stiffnesses),
                {"units": "N/m", "long_name": "stiffness of the springs"},
            ),
        },
    )


def explicit_schemes() -> dict[str, Scheme]:
    """Return the schemes whose steps are bound by stability."""
    return {
        name: kind for name, kind in INTEGRATORS.items() if issubclass(kind, ExplicitIntegrator)
    }


def bare_springs(case: Case, stiffness: float) -> SoftBodyModel:
    """Return the springs of a case alone, undamped."""
    bare = case.with_law(MassSpring, stiffness=stiffness, damping=0.0)
    springs = [force for force in bare.forces if isinstance(force, MassSpring)]
    return SoftBodyModel(bare.mesh, bare.mass, springs, bare.weights)


def largest_eigenvalue(model: SoftBodyModel) -> float:
    """λ_max of M⁻¹K of bare springs at rest, 1/s², from their assembled stiffness matrix."""
    (springs,) = (law for law in model.laws if isinstance(law, MassSpring))
    difference, sides = model.mesh.edge_difference, model.mesh.edge_difference @ model.mesh.points
    along = (sides / np.linalg.norm(sides, axis=1)[:, None]).T
    # at rest a spring resists along itself alone: K = α k_s Sᵀ S, with S x the edges' stretch
    stretch = sp.hstack([sp.diags_array(row) @ difference for row in along])
    matrix = model.weights.alpha * springs.stiffness * (stretch.T @ stretch)
    scale = sp.diags_array(np.tile(1 / np.sqrt(model.masses), 3))
    start = np.random.default_rng(1).normal(size=3 * model.mesh.n_points)
    largest = scipy.sparse.linalg.eigsh(
        scale @ matrix @ scale, k=1, v0=start, return_eigenvectors=False
    )
    return float(largest[0])


def measured_limit(kind: Scheme, model: SoftBodyModel, scale: float) -> float:
    """Bisect for the largest step at which a small disturbance does not grow.

    Parameters
    ----------
    kind : callable
        Makes an explicit scheme of its options.
    model : SoftBodyModel
        At rest without inputs.
    scale : float
        A step of the limit's size, s: it is sought between a quarter and four times that.

    Returns
    -------
    float
        s; NaN if it lies outside.
    """
    low, high = scale / 4, scale * 4
    if not stays_small(kind, model, low) or stays_small(kind, model, high):
        return math.nan
    while high / low > _RESOLVED:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stays_small(kind, model, middle) else (low, middle)
    return math.sqrt(low * high)


def stays_small(kind: Scheme, model: SoftBodyModel, h: float) -> bool:
    """Tell whether a small disturbance stays small over many equal steps of length h."""
    body = SoftBody(model, kind(max_substep=h, safety=1e12))  # h decides, not the estimated limit
    size = float(np.cbrt(model.mesh.volume))
    kick = np.random.default_rng(2).normal(size=body.state.positions.shape)
    kick *= 1e-9 * size / h
    body.state = replace(body.state, velocities=kick)
    for _ in range(_ROUNDS):
        try:
            body.step(_SUBSTEPS * h)
        except DivergenceError:
            return False
        if np.abs(body.state.velocities).max() > _GROWTH * np.abs(kick).max():
            return False
    return True


def _estimated(kind: Scheme, model: SoftBodyModel, scale: float) -> float:
    """Return the substep that a scheme takes by itself, at a safety of 1, s."""
    body = SoftBody(model, kind(safety=1.0))
    span = 1000 * scale
    body.step(span)
    return span / body.counters.steps
