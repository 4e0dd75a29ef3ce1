"""What a volume curve says: breaths, compartments, curve fits."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.signal import find_peaks

from scenarios.errors import ScenarioError


def breaths(dataset: xr.Dataset) -> xr.Dataset:
    """Volumes of each complete breath.

    A breath begins where the controller's `phase` turns to inhalation; without a `phase`, where the
    volume is lowest.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of `scenarios.run`.

    Returns
    -------
    xarray.Dataset
        Along ``breath``: `end_inspiratory_volume` (its largest volume), `end_expiratory_volume` (at
        its end), `tidal_volume` (their difference) and `residual_volume` (end-expiratory less
        rest), L; `start` and `duration`, s.
    """
    times = dataset["time"].to_numpy()
    volume = dataset["volume"].to_numpy()
    bounds = _breath_bounds(dataset)
    spans = list(pairwise(bounds))
    top = np.array([volume[a : b + 1].max() for a, b in spans])
    end = np.array([volume[b] for _, b in spans])
    start = np.array([times[a] for a, _ in spans])
    duration = np.array([times[b] - times[a] for a, b in spans])

    def along(values: NDArray[np.float64], units: str, name: str) -> tuple[str, object, object]:
        return "breath", values, {"units": units, "long_name": name}

    return xr.Dataset(
        {
            "end_inspiratory_volume": along(top, "L", "end-inspiratory volume"),
            "end_expiratory_volume": along(end, "L", "end-expiratory volume"),
            "tidal_volume": along(top - end, "L", "tidal volume"),
            "residual_volume": along(end - volume[0], "L", "end-expiratory volume less rest"),
            "start": along(start, "s", "start of the breath"),
            "duration": along(duration, "s", "length of the breath"),
        },
        coords={"breath": np.arange(1, len(spans) + 1)},
    )


def whole_breaths(dataset: xr.Dataset) -> xr.Dataset:
    """Volumes of each breath, as `breaths` gives them.

    Raises
    ------
    ScenarioError
        If the run has no complete breath.
    """
    volumes = breaths(dataset)
    if volumes.sizes["breath"] == 0:
        raise ScenarioError("the run has no complete breath; give it at least one cycle")
    return volumes


def _breath_bounds(dataset: xr.Dataset) -> NDArray[np.int64]:
    """Indices at which breaths begin and end."""
    last = dataset.sizes["time"] - 1
    if "phase" not in dataset:
        volume = dataset["volume"].to_numpy()
        swing = np.ptp(volume)
        lows = find_peaks(-volume, prominence=0.2 * swing)[0] if swing > 0 else np.array([], int)
        return np.concatenate([[0], lows]).astype(np.int64)
    # A sample holds the phase of the step that ends there, so a turn at sample i is a breath that
    # began one sample earlier; sample 0 is before any step.
    inhaling = dataset["phase"].to_numpy()[1:] > 0
    turns = np.flatnonzero(inhaling[1:] & ~inhaling[:-1]) + 1
    bounds = np.concatenate([[0], turns])
    ended = len(inhaling) > 0 and not inhaling[-1]
    if len(bounds) > 1:
        whole = last - bounds[-1] >= 0.95 * (bounds[-1] - bounds[-2])
    else:  # nothing to compare it with, but a run lasts for whole breaths if it is not cut short
        whole = dataset.attrs.get("status", "completed") == "completed"
    if ended and whole and last > bounds[-1]:
        bounds = np.append(bounds, last)
    return bounds.astype(np.int64)


@dataclass(frozen=True)
class Compartment:
    """One resistance and one compliance that stand for a body.

    Attributes
    ----------
    resistance : float
        R, cmH2O·s/L.
    compliance : float
        C, L/cmH2O.
    offset : float
        Pressure at volume 0, cmH2O.
    """

    resistance: float
    compliance: float
    offset: float

    def tidal_volume(
        self, driving_pressure: float, inspiratory_time: float, period: float
    ) -> float:
        """Tidal volume under a square wave of pressure, in the periodic state, L.

        Parameters
        ----------
        driving_pressure : float
            Of the wave, cmH2O.
        inspiratory_time, period : float
            Of the wave, s.
        """
        constant = self.resistance * self.compliance
        filled, emptied, whole = (
            -np.expm1(-span / constant)
            for span in (inspiratory_time, period - inspiratory_time, period)
        )
        return float(self.compliance * driving_pressure * filled * emptied / whole)


def fit_compartment(dataset: xr.Dataset) -> Compartment:
    """Fit R, C and an offset to a run: pressure = R·flow + V/C + offset, by least squares.

    This is the equation of motion of a one-compartment lung, as ventilators fit it.

    Raises
    ------
    ScenarioError
        If pressure, flow and volume do not determine the three numbers.
    """
    moving = dataset.isel(time=slice(1, None))
    volume = moving["volume"].to_numpy()
    columns = np.stack([moving["flow"].to_numpy(), volume, np.ones_like(volume)], axis=1)
    solution, _, rank, _ = np.linalg.lstsq(columns, moving["pressure"].to_numpy())
    if rank < 3 or solution[1] <= 0:
        raise ScenarioError(
            "pressure, flow and volume of this run do not determine a resistance and a compliance; "
            "fit a run in which the volume changes and the pressure drives it"
        )
    resistance, elastance, offset = (float(value) for value in solution)
    return Compartment(resistance, 1 / elastance, offset)
