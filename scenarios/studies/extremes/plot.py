"""A picture of the map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from scenarios.studies.extremes.verdict import Outcome

_COLOURS = {
    Outcome.RIGHT: "#56b4e9",
    Outcome.BOUNDED: "#f0e442",
    Outcome.ERROR: "#999999",
    Outcome.DEFECT: "#d55e00",
}
"""After Okabe & Ito: apart for colour-blind people. A defect also bears a cross."""

_COLUMNS = 4


def picture(dataset: xr.Dataset) -> Figure:
    """Draw the outcomes, a panel for each axis, and the stability limits.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of `scenarios.studies.extremes.survey`.
    """
    names = list(dict.fromkeys(dataset["axis"].to_numpy().tolist()))
    wide = [name for name in names if name == "shape"]
    small = [name for name in names if name not in wide]
    rows = -(-len(small) // _COLUMNS)
    figure = Figure(figsize=(14, 2.2 * rows + 6.5), layout="constrained")
    top, bottom = figure.subfigures(2, 1, squeeze=False, height_ratios=[2.2 * rows, 5.5]).ravel()
    panels = top.subplots(rows, _COLUMNS, squeeze=False).ravel()
    for axes in panels[len(small) :]:
        axes.set_visible(False)
    for index, (axes, name) in enumerate(zip(panels, small, strict=False)):
        _panel(axes, dataset, name, named=index % _COLUMNS == 0)
    grid = bottom.add_gridspec(2, 2, width_ratios=[1.5, 1])
    for name in wide:
        _panel(bottom.add_subplot(grid[:, 0]), dataset, name, named=True)
    steps = bottom.add_subplot(grid[0, 1])
    _limits(steps, bottom.add_subplot(grid[1, 1], sharex=steps), dataset)
    handles = [
        Patch(color=colour, label=outcome.name.lower()) for outcome, colour in _COLOURS.items()
    ]
    top.legend(handles=handles, loc="outside upper right", ncols=4, frameon=False)
    top.suptitle(dataset.attrs["title"], x=0.01, ha="left")
    return figure


def _panel(axes: Axes, dataset: xr.Dataset, name: str, *, named: bool) -> None:
    trials = dataset.isel(case=np.flatnonzero(dataset["axis"] == name))
    outcome = trials["outcome"].to_numpy().T
    colours = ListedColormap(list(_COLOURS.values()))
    axes.pcolormesh(outcome, cmap=colours, vmin=-0.5, vmax=len(_COLOURS) - 0.5, ec="w", lw=1)
    for row, column in np.argwhere(outcome == Outcome.DEFECT):
        axes.text(column + 0.5, row + 0.5, "×", ha="center", va="center", weight="bold")
    settings = trials["setting"].to_numpy().tolist()
    rotation = 90 if sum(map(len, settings)) > 30 else 0  # or they run into each other
    axes.set_xticks(np.arange(len(settings)) + 0.5, settings, rotation=rotation, fontsize=7)
    integrators = trials["integrator"].to_numpy().tolist() if named else []
    axes.set_yticks(np.arange(len(integrators)) + 0.5, integrators, fontsize=8)
    unit = str(trials["unit"].to_numpy()[0])
    axes.set_title(name if unit in ("", "1") else f"{name} ({unit})", fontsize=9)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)


def _limits(steps: Axes, ratios: Axes, dataset: xr.Dataset) -> None:
    """Draw the limits, and under them their ratio to 2/√λ_max, which shows the difference."""
    stiffness, exact = dataset["spring_stiffness"], dataset["two_over_omega"]
    steps.plot(stiffness, exact, color="k", lw=1, label="2/√λ_max")
    ratios.axhline(1, color="k", lw=1)
    for scheme, marker in zip(dataset["scheme"].to_numpy(), "osD^v<>", strict=False):
        limits = dataset.sel(scheme=scheme)
        size = {"o": 10}.get(marker, 6)  # two schemes share a limit: show one around the other
        (points,) = steps.plot(
            stiffness, limits["measured_limit"], marker, ms=size, mfc="none", label=scheme
        )
        colour = points.get_color()
        ratios.plot(
            stiffness, limits["measured_limit"] / exact, marker, ms=size, mfc="none", c=colour
        )
        ratios.plot(stiffness, limits["estimated_limit"] / exact, "_", ms=12, mew=2, c=colour)
    steps.set(xscale="log", yscale="log", ylabel="largest stable step (s)")
    steps.set_title("stability of the bare, undamped springs, as measured", fontsize=9)
    steps.legend(frameon=False, fontsize=8)
    ratios.set(xlabel="spring stiffness (N/m)", ylabel="over 2/√λ_max", ylim=(0, 1.75))
    ratios.set_title("signs: measured; bars: the scheme's own estimate", fontsize=8)
    for axes in (steps, ratios):
        axes.spines[["top", "right"]].set_visible(False)


def save_picture(dataset: xr.Dataset, path: Path) -> None:
    """Write `picture` to a file."""
    picture(dataset).savefig(path, dpi=120)
