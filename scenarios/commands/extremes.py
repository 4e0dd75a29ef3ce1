"""The command ``softbody extremes``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr
from rich.table import Table

from scenarios.commands.options import (
    Changes,
    Dataset,
    Flag,
    Plot,
    Quiet,
    ScenarioName,
    build_scenario,
    read_seconds,
)
from scenarios.commands.terminal import Terminal
from scenarios.errors import RunError
from scenarios.results.files import check_results, save_results
from scenarios.studies.extremes.plot import save_picture
from scenarios.studies.extremes.survey import survey
from scenarios.studies.extremes.verdict import Outcome


def extremes_(
    scenario: ScenarioName,
    /,
    *,
    set_: Changes = (),
    output: Dataset = Path("extremes.nc"),
    reduced: Flag = False,
    limit: str = "20 s",
    plot: Plot = True,
    quiet: Quiet = False,
) -> None:
    """Map what becomes of a scenario's body at the extremes, under every integrator.

    Parameters
    ----------
    reduced
        Take a few values of each axis.
    limit
        Computing time that one trial may take, such as "20 s"; more is a defect.
    """
    scene, seconds = build_scenario(scenario, set_), read_seconds(limit, "--limit")
    picture = check_results(output, plot=plot)
    terminal = Terminal(quiet=quiet)
    with terminal.study_bar("case") as progress:
        dataset = survey(scene, reduced=reduced, seconds=seconds, progress=progress)
    written = save_results(dataset, output, picture, save_picture)
    show_outcomes(terminal, dataset)
    terminal.line(written)
    defects = int((dataset["outcome"] == Outcome.DEFECT).sum())
    if defects:
        ended = "trial ends" if defects == 1 else "trials end"
        raise RunError(f"{defects} {ended} in a defect; {output} says how", dataset)


def show_outcomes(terminal: Terminal, dataset: xr.Dataset) -> None:
    """Print how many trials of each axis ended in which way, and every defect."""
    table = Table(title=dataset.attrs["title"])
    table.add_column("axis")
    for outcome in Outcome:
        table.add_column(outcome.name.lower(), justify="right")
    axis = dataset["axis"].to_numpy()
    outcomes = dataset["outcome"].to_numpy()
    for name in [*dict.fromkeys(axis.tolist()), "all"]:
        trials = outcomes if name == "all" else outcomes[axis == name]
        counts = (np.count_nonzero(trials == outcome) for outcome in Outcome)
        table.add_row(name, *map(str, counts))
    terminal.show(table)
    for case, scheme in np.argwhere(outcomes == Outcome.DEFECT):
        trial = dataset.isel(case=case, integrator=scheme)
        unit = "" if trial["unit"].item() in ("", "1") else f" {trial['unit'].item()}"
        terminal.line(
            f"defect: {trial['axis'].item()} = {trial['setting'].item()}{unit}, "
            f"{trial['integrator'].item()}: {trial['message'].item()}"
        )
