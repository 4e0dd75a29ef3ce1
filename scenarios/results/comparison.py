"""How far two runs are apart."""

from __future__ import annotations

import numpy as np
import xarray as xr

from scenarios.errors import ScenarioError


def volume_error(dataset: xr.Dataset, reference: xr.Dataset) -> float:
    """Largest deviation of the volume from a reference, as a share of the reference's range.

    Only times that both have are compared, so that nothing is interpolated. Two communication
    steps share all points of the longer one if the shorter one divides it.

    Parameters
    ----------
    dataset, reference : xarray.Dataset
        Of `scenarios.run`.

    Returns
    -------
    float
        max |V − V_ref| / (max V_ref − min V_ref), 1.

    Raises
    ------
    ScenarioError
        If they share no time but the start, or the reference's volume does not change.
    """
    ours, theirs = dataset["time"].to_numpy(), reference["time"].to_numpy()
    slack = 1e-9 * theirs[-1]  # i · h and 2i · h/2 differ by rounding
    match = np.minimum(np.searchsorted(theirs, ours - slack), len(theirs) - 1)
    common = np.abs(theirs[match] - ours) <= slack
    volume = reference["volume"].to_numpy()
    swing = float(np.ptp(volume))
    if common.sum() < 2 or swing == 0:
        raise ScenarioError(
            f"a run of {len(ours)} samples to {ours[-1]:g} s cannot be compared with one of "
            f"{len(theirs)} samples to {theirs[-1]:g} s, whose volume changes by {swing:g} L: "
            "expected times in common, and a volume that changes"
        )
    deviation = dataset["volume"].to_numpy()[common] - volume[match[common]]
    return float(np.abs(deviation).max() / swing)
