"""Pictures of a run."""

from __future__ import annotations

from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure


def overview(dataset: xr.Dataset) -> Figure:
    """Volume over time with the controller's target, and the pressure-volume loop.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of `scenarios.run`.
    """
    figure = Figure(figsize=(11, 4.2), layout="constrained")
    curve, loop = figure.subplots(1, 2, width_ratios=[1.7, 1])
    time = dataset["time"]
    curve.plot(time, dataset["volume"], label="volume")
    if "target_volume" in dataset:
        curve.plot(time, dataset["target_volume"], "--", linewidth=1, label="target")
    curve.axhline(float(dataset["volume"][0]), color="0.7", linewidth=0.8, label="rest")
    curve.set(xlabel="time (s)", ylabel="volume (L)")
    curve.margins(x=0)
    curve.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False)
    drive = "respiratory_pressure" if "respiratory_pressure" in dataset else "alveolar_pressure"
    loop.plot(dataset[drive], dataset["volume"])
    loop.set(xlabel=f"{drive.replace('_', ' ')} (cmH2O)", ylabel="volume (L)")
    for axes in (curve, loop):
        axes.spines[["top", "right"]].set_visible(False)
    status = dataset.attrs.get("status", "completed")
    note = "" if status == "completed" else " — ended early"
    controller = dataset.attrs.get("controller")
    driven = "" if controller is None else f" — {controller}"
    figure.suptitle(f"{dataset.attrs.get('title', '')}{driven}{note}")
    return figure


def save_overview(dataset: xr.Dataset, path: Path) -> None:
    """Write `overview` as a picture."""
    overview(dataset).savefig(path, dpi=120)
