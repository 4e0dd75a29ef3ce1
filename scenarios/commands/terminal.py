"""What people see in a terminal: a progress bar, and a table of breaths."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

import xarray as xr
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from cosim import UnitError, quantity
from scenarios.results.analysis import breaths
from scenarios.running.run import Progress as RunProgress
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


@contextmanager
def progress_bar(console: Console) -> Iterator[Callable[[RunProgress], None]]:
    """Show simulated time and speed while a run goes on."""
    columns = (
        BarColumn(bar_width=30),
        TextColumn("{task.fields[time]:6.2f} of {task.total:.2f} s simulated"),
        TextColumn("{task.fields[speed]:5.1f} × real time"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, disable=console.quiet) as bar:
        task = bar.add_task("run", total=None, time=0.0, speed=0.0, visible=False)

        def show(progress: RunProgress) -> None:
            speed = progress.time / progress.wall_time if progress.wall_time > 0 else 0.0
            bar.update(
                task,
                total=progress.duration,
                completed=progress.time,
                time=progress.time,
                speed=speed,
                visible=True,
            )

        yield show


def show_controller(console: Console, controller: Controller, period: float) -> None:
    """Say which controller runs, with what settings, and if its period is not the run's, s."""
    settings = ", ".join(f"{name} = {value}" for name, value in controller.parameters.items())
    said = settings or f"its own defaults (the scenario has no table [controller.{controller.key}])"
    console.print(f"controller {controller.use}: {said}", highlight=False, markup=False)
    own = controller.parameters.get("period")
    try:
        same = not isinstance(own, str) or math.isclose(quantity(own, "s"), period, rel_tol=1e-9)
    except UnitError:  # a foreign controller's period may be something else
        return
    if not same:
        console.print(
            f"note: the controller's period is {own}, and run.period {period:g} s: the run may "
            "end within a breath",
            highlight=False,
            soft_wrap=True,
        )


def show_warnings(console: Console, dataset: xr.Dataset) -> None:
    """Say what the controller's FMU warned of, the first few times."""
    warnings = dataset.attrs.get("controller_warnings", "").splitlines()
    for warning in warnings[:_MOST_WARNINGS]:
        console.print(f"controller warned: {warning}", highlight=False, markup=False)
    if len(warnings) > _MOST_WARNINGS:
        more = len(warnings) - _MOST_WARNINGS
        console.print(f"… {more} more in the dataset's controller_warnings", highlight=False)


def show_shape(console: Console, dataset: xr.Dataset) -> None:
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
    console.print(table)


def show_breaths(console: Console, dataset: xr.Dataset) -> None:
    """Print the volumes of each breath, and how fast the run was."""
    seen = breaths(dataset)
    simulated = float(dataset["time"][-1])
    speed = simulated / dataset.attrs["wall_time"] if dataset.attrs["wall_time"] > 0 else 0.0
    caption = (
        f"{simulated:.4g} s simulated in {dataset.attrs['wall_time']:.3g} s "
        f"(real-time factor {speed:.3g}); rest volume {float(dataset['volume'][0]):.4g} L"
    )
    if seen.sizes["breath"] == 0:
        console.print(f"no complete breath; {caption}", highlight=False)
        return
    table = Table(title=dataset.attrs["title"], caption=caption, caption_justify="left")
    for heading in ("breath", *_COLUMNS):
        table.add_column(heading, justify="right")
    for number in seen["breath"].to_numpy():
        one = seen.sel(breath=number)
        table.add_row(str(number), *(f"{float(one[name]):.3f}" for name in _COLUMNS.values()))
    console.print(table)
