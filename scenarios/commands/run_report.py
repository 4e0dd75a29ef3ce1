"""What the terminal shows of a run: a table of breaths, the controller, warnings."""

from __future__ import annotations

import math
from typing import Final

import xarray as xr
from rich.table import Table

from cosim import UnitError, quantity
from scenarios.commands.terminal import Terminal
from scenarios.results.analysis import breaths
from scenarios.scene.controller import Controller

_COLUMNS: Final = {
    "end-insp. (L)": "end_inspiratory_volume",
    "end-exp. (L)": "end_expiratory_volume",
    "tidal (L)": "tidal_volume",
    "residual (L)": "residual_volume",
    "duration (s)": "duration",
}
"""Heading and variable of each column of the table of breaths."""

_MOST_WARNINGS: Final = 3


def show_run(terminal: Terminal, dataset: xr.Dataset) -> None:
    """Print the breaths, or what became of a body that does not breathe."""
    if "controller" in dataset.attrs:
        show_breaths(terminal, dataset)
    else:
        show_shape(terminal, dataset)


def show_controller(terminal: Terminal, controller: Controller, period: float) -> None:
    """Say which controller runs, with what settings, and if its period is not the run's, s."""
    settings = ", ".join(f"{name} = {value}" for name, value in controller.parameters.items())
    defaults = f"its own defaults (the scenario has no table [controller.{controller.key}])"
    terminal.line(f"controller {controller.use}: {settings or defaults}")
    other = controller.parameters.get("period")
    try:
        same = not isinstance(other, str) or math.isclose(
            quantity(other, "s"), period, rel_tol=1e-9
        )
    except UnitError:  # a foreign controller's period may be something else
        return
    if not same:
        terminal.line(
            f"note: the controller's period is {other}, and run.period {period:g} s: the run may "
            "end within a breath"
        )


def show_warnings(terminal: Terminal, dataset: xr.Dataset) -> None:
    """Say what the controller's FMU warned of, the first few times."""
    warnings = dataset.attrs.get("controller_warnings", "").splitlines()
    for warning in warnings[:_MOST_WARNINGS]:
        terminal.line(f"controller warned: {warning}")
    if len(warnings) > _MOST_WARNINGS:
        more = len(warnings) - _MOST_WARNINGS
        terminal.line(f"… {more} more in the dataset's controller_warnings")


def show_shape(terminal: Terminal, dataset: xr.Dataset) -> None:
    """Print what became of a body that does not breathe, and how fast the run was."""
    volume = dataset["volume"].to_numpy()
    simulated, wall_time = float(dataset["time"][-1]), dataset.attrs["wall_time"]
    frames = dataset.sizes["time"] - 1
    rows = {
        "volume at rest (L)": f"{volume[0]:.4g}",
        "volume at the end, over that at rest": f"{volume[-1] / volume[0]:.3f}",
        "smallest and largest": f"{volume.min() / volume[0]:.3f} … {volume.max() / volume[0]:.3f}",
    }
    if "clearance" in dataset:
        nearest = 1000 * float(dataset["clearance"].min())
        rows["nearest to an obstacle, at least (mm)"] = f"{nearest:.3g}"
    if wall_time > 0:
        rows["frames"] = f"{frames}, {frames / wall_time:.0f} a second"
        rows["real-time factor"] = f"{simulated / wall_time:.3g}"
    table = Table(title=dataset.attrs["title"], show_header=False)
    table.add_column()
    table.add_column(justify="right")
    for name, value in rows.items():
        table.add_row(name, value)
    terminal.show(table)


def show_breaths(terminal: Terminal, dataset: xr.Dataset) -> None:
    """Print the volumes of each breath, and how fast the run was."""
    volumes = breaths(dataset)
    simulated = float(dataset["time"][-1])
    speed = simulated / dataset.attrs["wall_time"] if dataset.attrs["wall_time"] > 0 else 0.0
    caption = (
        f"{simulated:.4g} s simulated in {dataset.attrs['wall_time']:.3g} s "
        f"(real-time factor {speed:.3g}); rest volume {float(dataset['volume'][0]):.4g} L"
    )
    if volumes.sizes["breath"] == 0:
        terminal.line(f"no complete breath; {caption}")
        return
    table = Table(title=dataset.attrs["title"], caption=caption, caption_justify="left")
    for heading in ("breath", *_COLUMNS):
        table.add_column(heading, justify="right")
    for number in volumes["breath"].to_numpy():
        breath = volumes.sel(breath=number)
        table.add_row(str(number), *(f"{float(breath[name]):.3f}" for name in _COLUMNS.values()))
    terminal.show(table)
