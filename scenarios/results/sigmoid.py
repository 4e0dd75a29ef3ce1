"""The sigmoid of a pressure-volume curve, and how well a limb of a loop follows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import curve_fit

from scenarios.errors import ScenarioError
from scenarios.results.analysis import whole_breaths


def sigmoid(pressure: ArrayLike, a: float, b: float, c: float, d: float) -> NDArray[np.float64]:
    """Volume at a pressure: a + b / (1 + exp(−(P − c)/d)), L.

    J. G. Venegas, R. S. Harris, B. A. Simon, J Appl Physiol 84:389, 1998.

    Parameters
    ----------
    pressure : array_like
        cmH2O.
    a, b : float
        Lower asymptote and vital capacity, L.
    c, d : float
        Pressure of the largest compliance, and a fourth of the range that holds most of the change
        of volume, cmH2O.
    """
    return np.asarray(a + b / (1 + np.exp(-(np.asarray(pressure) - c) / d)))


@dataclass(frozen=True)
class SigmoidFit:
    """A sigmoid that was fitted to a limb.

    Attributes
    ----------
    values, errors : dict
        a, b (L), c, d (cmH2O), and their standard errors. These hold for residuals that are
        independent; those of a curve are not, so they are lower bounds.
    r_squared : float
        Share of the volume's variance that the sigmoid explains.
    has_inflection : bool
        False if c is at the end of the range of pressures: the limb bends one way only there, and
        b, c and d are not determined.
    """

    values: dict[str, float]
    errors: dict[str, float]
    r_squared: float
    has_inflection: bool

    def __str__(self) -> str:
        units = dict.fromkeys("ab", "L") | dict.fromkeys("cd", "cmH2O")
        numbers = (
            f"{key} = {self.values[key]:.3f} ± {self.errors[key]:.3f} {units[key]}"
            for key in self.values
        )
        return f"{', '.join(numbers)}, R² = {self.r_squared:.5f}"


def fit_sigmoid(pressure: ArrayLike, volume: ArrayLike) -> SigmoidFit:
    """Fit a sigmoid to one limb of a loop, by least squares in the volume.

    Parameters
    ----------
    pressure : array_like, shape (n,)
        cmH2O.
    volume : array_like, shape (n,)
        L. More than four samples that differ.

    Raises
    ------
    ScenarioError
        If the limb does not determine four numbers.
    """
    p, v = np.asarray(pressure, dtype=float), np.asarray(volume, dtype=float)
    swing, breath = np.ptp(p) if p.size else 0.0, np.ptp(v) if v.size else 0.0
    if p.size <= 4 or swing == 0 or breath == 0:
        raise ScenarioError(
            f"a limb of {p.size} samples that spans {swing:g} cmH2O and {breath:g} L does not "
            "determine a sigmoid; expected more than 4 samples over which both change"
        )
    # c has to lie in the range: beyond it b and c grow together without end
    bounds = (
        [v.min() - breath, 0.0, p.min(), 1e-3 * swing],
        [v.max(), 10 * breath, p.max(), 2 * swing],
    )
    start = (v.min(), breath, p.min() + swing / 2, swing / 8)
    fitted, covariance = curve_fit(sigmoid, p, v, p0=start, bounds=bounds, x_scale="jac")
    residual = v - sigmoid(p, *fitted)
    names = ("a", "b", "c", "d")
    return SigmoidFit(
        dict(zip(names, fitted.tolist(), strict=True)),
        dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True)),
        float(1 - residual @ residual / np.sum((v - v.mean()) ** 2)),
        bool(p.min() + 1e-3 * swing < fitted[2] < p.max() - 1e-3 * swing),
    )


def limbs(dataset: xr.Dataset) -> dict[str, xr.Dataset]:
    """Samples of the first breath's ``inflation`` and ``deflation``.

    The first breath starts at the rest volume, as f(P) does. Later ones start at what the breath
    before left inside, and wait there until f(P) has caught up.

    Raises
    ------
    ScenarioError
        If the run has no complete breath.
    """
    first = whole_breaths(dataset).isel(breath=0)
    end = float(first["start"] + first["duration"])
    breath = dataset.isel(time=slice(1, None)).sel(time=slice(0.0, end * (1 + 1e-9)))
    inhaling = breath["phase"].to_numpy() > 0
    return {
        "inflation": breath.isel(time=np.flatnonzero(inhaling)),
        "deflation": breath.isel(time=np.flatnonzero(~inhaling)),
    }


def fit_limb(limb: xr.Dataset) -> SigmoidFit:
    """Fit a limb's volume against the controller's respiratory pressure."""
    return fit_sigmoid(limb["respiratory_pressure"], limb["volume"])
