"""The command ``softbody extremes``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import xarray as xr
from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from scenarios.commands.options import chosen, seconds
from scenarios.errors import RunError
from scenarios.results.files import check_results, save_results
from scenarios.studies.extremes.plot import save_picture
from scenarios.studies.extremes.survey import survey
from scenarios.studies.extremes.verdict import Outcome


def extremes_(
    scenario: str,
    /,
    *,
    set_: Annotated[tuple[str, ...], Parameter(name="--set", negative=())] = (),
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("extremes.nc"),
    reduced: Annotated[bool, Parameter(negative=())] = False,
    limit: str = "20 s",
    plot: bool = True,
    quiet: Annotated[bool, Parameter(negative=())] = False,
) -> None:
    """Map what becomes of a scenario's body at the extremes, under every integrator.

    Parameters
    ----------
    scenario
        A name from `softbody list`, or a TOML file.
    set_
        Change a value of the scenario, such as --set mesh.icosphere=2. May be repeated.
    output
        The netCDF4 file to write; the picture gets the same name with .png.
    reduced
        Take a few values of each axis.
    limit
        Computing time that one trial may take, such as "20 s"; more is a defect.
    plot
        Draw the picture.
    quiet
        Print nothing but errors.
    """
    scene, allowed = chosen(scenario, set_), seconds(limit, "--limit")
    picture = check_results(output, plot=plot)
    out = Console(quiet=quiet)
    columns = (
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=out, disable=quiet) as bar:
        task = bar.add_task("", total=None)
        dataset = survey(
            scene,
            reduced=reduced,
            seconds=allowed,
            progress=lambda done, total, name: bar.update(
                task, completed=done, total=total, description=name
            ),
        )
    written = save_results(dataset, output, picture, save_picture)
    show_outcomes(out, dataset)
    out.print(written, highlight=False, soft_wrap=True)
    defects = int((dataset["outcome"] == Outcome.DEFECT).sum())
    if defects:
        ended = "trial ends" if defects == 1 else "trials end"
        raise RunError(f"{defects} {ended} in a defect; {output} says how", dataset)


def show_outcomes(console: Console, dataset: xr.Dataset) -> None:
    """Print how many trials of each axis ended in which way, and every defect."""
    table = Table(title=dataset.attrs["title"])
    table.add_column("axis")
    for outcome in Outcome:
        table.add_column(outcome.name.lower(), justify="right")
    axis = dataset["axis"].to_numpy()
    outcomes = dataset["outcome"].to_numpy()
    for name in [*dict.fromkeys(axis.tolist()), "all"]:
        seen = outcomes if name == "all" else outcomes[axis == name]
        table.add_row(name, *(str(np.count_nonzero(seen == outcome)) for outcome in Outcome))
    console.print(table)
    for case, scheme in np.argwhere(outcomes == Outcome.DEFECT):
        one = dataset.isel(case=case, integrator=scheme)
        unit = "" if one["unit"].item() in ("", "1") else f" {one['unit'].item()}"
        console.print(
            f"defect: {one['axis'].item()} = {one['setting'].item()}{unit}, "
            f"{one['integrator'].item()}: {one['message'].item()}",
            highlight=False,
            markup=False,
            soft_wrap=True,
        )
