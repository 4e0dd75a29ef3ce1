"""Work-precision plot of a trade."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from textwrap import fill
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from scenarios.studies.trade.axes import AXES
from scenarios.studies.trade.pareto import at_most, floor, front
from scenarios.studies.trade.settings import value_text

Floats = NDArray[np.float64]

_MARKERS: Final = "osD^vP*X"


def work_precision(dataset: xr.Dataset) -> Figure:
    """Error over wall time, as lines along the inner step, or along another axis of numbers.

    Each scheme has its colour. Rings mark the Pareto front. Errors that the reference cannot tell
    from zero are drawn at the dotted line, below which nothing is known.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of `scenarios.trade`.
    """
    figure = Figure(figsize=(8.5, 5.2), layout="constrained")
    axes = figure.subplots()
    smallest = floor(dataset)
    shown = dataset.assign(
        error=dataset["error"].where(~at_most(dataset), smallest), front=front(dataset)
    )
    along = _line_axis(dataset)
    line_axes = [str(name) for name in dataset["error"].dims if name != along]
    colours: dict[object, str] = {}
    for count, values in enumerate(product(*(dataset[name].to_numpy() for name in line_axes))):
        setting = dict(zip(line_axes, values, strict=True))
        line = shown.sel(setting)
        cost, error = _places(line)
        if not len(error):
            continue
        colour = colours.setdefault(setting.get("integrator", count), f"C{len(colours)}")
        style: dict[str, Any] = {"color": colour, "marker": _MARKERS[count % len(_MARKERS)]}
        label = ", ".join(map(value_text, values)) or f"along {along}"
        axes.plot(cost, error, label=label, linewidth=1.2, markersize=4.5, **style)
        if along is not None:
            texts = line[along][line["error"].notnull()].to_numpy()
            for end in {0, len(error) - 1}:
                _annotate(axes, value_text(texts[end]), (cost[end], error[end]))
    if colours:  # nothing has a logarithmic scale without a number on it
        best = _places(shown.where(shown["front"]))
        axes.plot(*best, "o", markersize=11, fillstyle="none", color="0.2", label="Pareto front")
        axes.axhline(smallest, color="0.5", linestyle=":", linewidth=1, label="limit of reference")
        axes.set(xscale="log", yscale="log")
        title = None if along is None else f"numbers: {along.replace('_', ' ')}"
        figure.legend(loc="outside right upper", frameon=False, fontsize="small", title=title)
    axes.set(
        xlabel="wall time per simulated second (s/s)",
        ylabel="largest deviation of V(t) over its range (1)",
    )
    axes.set_title(fill(dataset.attrs["title"], 70), fontsize="medium")
    axes.grid(which="major", color="0.9")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _line_axis(dataset: xr.Dataset) -> str | None:
    """Axis along which lines are drawn: the inner step, else the last one of numbers, if any."""
    names = [str(name) for name in dataset["error"].dims]
    numbers = [name for name in names if np.issubdtype(dataset[name].dtype, np.number)]
    steps = [name for name in numbers if AXES[name].dearer]
    return steps[0] if steps else numbers[-1] if numbers else None


def _places(cells: xr.Dataset) -> tuple[Floats, Floats]:
    """Wall times and errors of the cells that have a result, in one row."""
    cost = cells["wall_time_per_second"].to_numpy().ravel()
    error = cells["error"].to_numpy().ravel()
    done = np.isfinite(error)
    return cost[done], error[done]


def _annotate(axes: Any, text: str, at: tuple[float, float]) -> None:
    axes.annotate(text, at, (5, 5), textcoords="offset points", fontsize=7, color="0.35")


def save_work_precision(dataset: xr.Dataset, path: Path) -> None:
    """Write `work_precision` as a picture."""
    work_precision(dataset).savefig(path, dpi=120)
