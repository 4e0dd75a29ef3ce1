"""The Pareto front: what no other setting beats in both error and cost."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray


def pareto(error: ArrayLike, cost: ArrayLike) -> NDArray[np.bool_]:
    """Tell which points lie on the Pareto front.

    A point does unless another is as good in both and better in one. Of points that are equal in
    both, all do. A point with NaN does not, and beats none.

    Parameters
    ----------
    error, cost : array_like
        Of one shape; less is better.

    Returns
    -------
    ndarray of bool
        Of that shape.
    """
    errors, costs = np.asarray(error, float), np.asarray(cost, float)
    e, c = errors.ravel(), costs.ravel()
    as_good = (e <= e[:, None]) & (c <= c[:, None])  # [i, j]: j is as good as i
    better = (e < e[:, None]) | (c < c[:, None])
    beaten = (as_good & better).any(axis=1)
    on_front: NDArray[np.bool_] = (~beaten & np.isfinite(e) & np.isfinite(c)).reshape(errors.shape)
    return on_front


def front(dataset: xr.Dataset) -> xr.DataArray:
    """Tell which cells of a trade lie on its front of error and wall time.

    Errors that the reference cannot tell from zero count as equal, so of those cells the cheapest
    one is on the front.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of `scenarios.trade`.
    """
    error = dataset["error"].where(~at_most(dataset), floor(dataset))
    return dataset["error"].copy(data=pareto(error, dataset["wall_time_per_second"]))


def floor(dataset: xr.Dataset) -> float:
    """Error below which the reference is not good enough to say how large it is.

    Three times what halving its step changes: its own error stays below that down to order 0.42.
    """
    return 3 * float(dataset.attrs["reference_error"])


def at_most(dataset: xr.Dataset) -> xr.DataArray:
    """Tell which cells have an error below `floor`: it is at most that."""
    return dataset["error"] < floor(dataset)
