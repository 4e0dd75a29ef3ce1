"""The command ``softbody trade``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from scenarios.commands.options import (
    Changes,
    ControllerName,
    Dataset,
    Plot,
    Quiet,
    ScenarioName,
    build_scenario,
    read_seconds,
)
from scenarios.commands.terminal import Terminal
from scenarios.commands.trade_report import show_trade
from scenarios.errors import RunError
from scenarios.results.files import check_results, save_results
from scenarios.studies.trade.grid import trade
from scenarios.studies.trade.plot import save_work_precision
from scenarios.studies.trade.settings import read_axes


def trade_(
    scenario: ScenarioName,
    /,
    *,
    axis: str = "integrator,dt",
    controller: ControllerName = None,
    set_: Changes = (),
    cycles: str = "1",
    output: Dataset = Path("trade.nc"),
    limit: str = "60 s",
    all_: Annotated[bool, Parameter(name="--all", negative=())] = False,
    plot: Plot = True,
    quiet: Quiet = False,
) -> None:
    """Run a grid of settings; write and print what accuracy costs.

    Parameters
    ----------
    axis
        What to vary, with commas: integrator, dt, tolerance, points, communication_step, algorithm,
        extrapolation.
        Values of your own go behind it: --axis integrator=sdirk2:rk4,dt=1:0.5
    cycles
        Number of breaths in each run.
    limit
        Computing time after which a cell is stopped.
    all_
        Print all cells, not the Pareto front alone.
    """
    scene = build_scenario(scenario, set_, cycles, controller)
    axes, longest = read_axes(axis), read_seconds(limit, "--limit")
    picture = check_results(output, plot=plot)
    terminal = Terminal(quiet=quiet)
    failure: RunError | None = None
    with terminal.study_bar("run") as progress:
        try:
            dataset = trade(scene, axes, scene.run.cycles, limit=longest, progress=progress)
        except RunError as error:
            failure, dataset = error, error.dataset
    written = save_results(dataset, output, picture, save_work_precision)
    show_trade(terminal, dataset, every=all_)
    terminal.line(written)
    if failure is not None:
        raise failure
