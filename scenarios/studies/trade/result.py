"""The dataset of a trade."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import xarray as xr

from scenarios.results.analysis import breaths
from scenarios.running.run import COMPLETED
from scenarios.scene.scenario import Scenario
from scenarios.studies.trade.axes import AXES, Value
from scenarios.studies.trade.reference import volume_error

NOT_REACHED: Final = "not reached"

COUNTS: Final = ("steps", "force_evaluations", "linear_solves")

_MEASURED: Final = {
    "error": ("1", "largest deviation of the volume over its range"),
    "end_expiratory_error": ("L", "deviation of the last end-expiratory volume"),
    "wall_time_per_second": ("1", "wall time per simulated second"),
    "steps": ("1", "inner steps"),
    "force_evaluations": ("1", "force evaluations"),
    "linear_solves": ("1", "linear solves"),
}

_KEPT: Final = ("versions", "controller", "controller_parameters", "controller_sha256")
"""Attributes of a run that hold for the whole grid."""


def empty(scenario: Scenario, values: Mapping[str, Sequence[Value]]) -> xr.Dataset:
    """Make the dataset of a grid of which no cell has run."""
    dims = tuple(values)
    shape = tuple(len(own) for own in values.values())
    dataset = xr.Dataset(
        {
            name: (dims, np.full(shape, np.nan), {"units": units, "long_name": said})
            for name, (units, said) in _MEASURED.items()
        },
        coords={
            name: (name, list(own), {"units": AXES[name].units, "long_name": AXES[name].long_name})
            for name, own in values.items()
        },
        attrs={
            "title": scenario.title,
            "scenario_name": scenario.name,
            "scenario": scenario.text,
            "reference": "none",
            "reference_error": np.nan,
        },
    )
    said = {"units": "1", "long_name": "completed, or why there is no result"}
    dataset["status"] = (dims, np.full(shape, NOT_REACHED, dtype=object), said)
    if "points" in values:
        said = {"units": "1", "long_name": "volume_error of the reference against the next mesh"}
        dataset["points_change"] = ("points", np.full(len(values["points"]), np.nan), said)
    return dataset


def describe_reference(
    dataset: xr.Dataset, reference: xr.Dataset, error: float, parts: int
) -> None:
    """Say what the cells are measured against."""
    dataset.attrs |= {
        "reference": f"sdirk2 in {parts} equal steps a communication step; half as many make "
        f"the reference_error",
        "reference_scenario": reference.attrs["scenario"],
        "reference_error": error,
        **{name: reference.attrs[name] for name in _KEPT if name in reference.attrs},
    }


def record(
    dataset: xr.Dataset, index: tuple[int, ...], run: xr.Dataset, reference: xr.Dataset
) -> None:
    """Measure a run, and put it into its cell."""
    simulated = float(run["time"][-1])
    found = {
        "error": volume_error(run, reference),
        "end_expiratory_error": abs(_end_expiratory(run) - _end_expiratory(reference)),
        "wall_time_per_second": run.attrs["wall_time"] / simulated,
        **{name: run.attrs[name] for name in COUNTS},
    }
    for name, value in found.items():
        dataset[name].to_numpy()[index] = value
    dataset["status"].to_numpy()[index] = COMPLETED


def _end_expiratory(run: xr.Dataset) -> float:
    """Volume at the end of the last complete breath, L; NaN without one."""
    volumes = breaths(run)["end_expiratory_volume"].to_numpy()
    return float(volumes[-1]) if len(volumes) else np.nan
