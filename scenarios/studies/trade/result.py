"""The dataset of a trade."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import xarray as xr

from scenarios.results.analysis import breaths
from scenarios.results.comparison import volume_error
from scenarios.running.run import COMPLETED
from scenarios.scene.scenario import Scenario
from scenarios.studies.trade.axes import AXES, Value

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

_SHARED: Final = ("versions", "controller", "controller_parameters", "controller_sha256")
"""Attributes of a run that hold for the whole grid."""


def empty(scenario: Scenario, values: Mapping[str, Sequence[Value]]) -> xr.Dataset:
    """Make the dataset of a grid of which no cell has run."""
    dims = tuple(values)
    shape = tuple(map(len, values.values()))
    dataset = xr.Dataset(
        {
            name: (dims, np.full(shape, np.nan), {"units": units, "long_name": long_name})
            for name, (units, long_name) in _MEASURED.items()
        },
        coords={
            name: (name, list(along), {"units": axis.units, "long_name": axis.long_name})
            for name, along in values.items()
            for axis in [AXES[name]]
        },
        attrs={
            "title": scenario.title,
            "scenario_name": scenario.name,
            "scenario": scenario.text,
            "reference": "none",
            "reference_error": np.nan,
        },
    )
    attributes = {"units": "1", "long_name": "completed, or why there is no result"}
    dataset["status"] = (dims, np.full(shape, NOT_REACHED, dtype=object), attributes)
    for name in filter(is_mesh, values):
        attributes = {
            "units": "1",
            "long_name": "volume_error of the reference against the next mesh",
        }
        dataset[f"{name}_change"] = (name, np.full(len(values[name]), np.nan), attributes)
    return dataset


def is_mesh(name: str) -> bool:
    """Whether the values of an axis stand for meshes."""
    return AXES[name].width is not None


def describe_reference(
    dataset: xr.Dataset, reference: xr.Dataset, error: float, parts: int
) -> None:
    """Write down what the cells are measured against."""
    dataset.attrs |= {
        "reference": f"sdirk2 in {parts} equal steps a communication step; half as many make "
        f"the reference_error",
        "reference_scenario": reference.attrs["scenario"],
        "reference_error": error,
        **{name: reference.attrs[name] for name in _SHARED if name in reference.attrs},
    }


def record(
    dataset: xr.Dataset, index: tuple[int, ...], run: xr.Dataset, reference: xr.Dataset
) -> None:
    """Measure a run, and put it into its cell."""
    simulated = float(run["time"][-1])
    measured = {
        "error": volume_error(run, reference),
        "end_expiratory_error": abs(_end_expiratory(run) - _end_expiratory(reference)),
        "wall_time_per_second": run.attrs["wall_time"] / simulated,
        **{name: run.attrs[name] for name in COUNTS},
    }
    for name, value in measured.items():
        dataset[name].to_numpy()[index] = value
    dataset["status"].to_numpy()[index] = COMPLETED


def _end_expiratory(run: xr.Dataset) -> float:
    """Volume at the end of the last complete breath, L; NaN without one."""
    volumes = breaths(run)["end_expiratory_volume"].to_numpy()
    return float(volumes[-1]) if len(volumes) else np.nan
