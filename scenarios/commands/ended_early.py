"""Runs that end early: what they had until then is written and shown, and then the error."""

from __future__ import annotations

from collections.abc import Callable

import xarray as xr

from scenarios.errors import RunError


def dataset_of(run: Callable[[], xr.Dataset]) -> tuple[xr.Dataset, RunError | None]:
    """Call `run`; give its dataset, or what there is of it with the error that ended it."""
    try:
        return run(), None
    except RunError as error:
        return error.dataset, error
