"""The command ``softbody trade``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from rich.console import Console

from scenarios.commands.options import chosen, seconds
from scenarios.commands.trade_report import grid_bar, show_trade
from scenarios.errors import RunError
from scenarios.results.files import check_results, save_results
from scenarios.running.run import with_controller
from scenarios.studies.trade.axes import read_axes
from scenarios.studies.trade.grid import trade
from scenarios.studies.trade.plot import save_work_precision


def trade_(
    scenario: str,
    /,
    *,
    axis: str = "integrator,dt",
    controller: str | None = None,
    set_: Annotated[tuple[str, ...], Parameter(name="--set", negative=())] = (),
    cycles: str = "1",
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("trade.nc"),
    limit: str = "60 s",
    all_: Annotated[bool, Parameter(name="--all", negative=())] = False,
    plot: bool = True,
    quiet: Annotated[bool, Parameter(negative=())] = False,
) -> None:
    """Run a grid of settings; write and print what accuracy costs.

    Parameters
    ----------
    scenario
        A name from `softbody list`, or a TOML file.
    axis
        What to vary, with commas: integrator, dt, tolerance, points, communication_step, algorithm,
        extrapolation.
        Values of your own go behind it: --axis integrator=sdirk2:rk4,dt=1:0.5
    controller
        Another controller: a name from `softbody controller list`, an FMU, or a Python file.
    set_
        Change a value, such as --set forces.alpha=0.5 or --set "body.mass=0.4 kg". May be repeated.
    cycles
        Number of breaths in each run.
    output
        The netCDF4 file to write; the work-precision plot gets the same name with .png.
    limit
        Computing time after which a cell is stopped.
    all_
        Print all cells, not the Pareto front alone.
    plot
        Draw the work-precision plot.
    quiet
        Print nothing but errors.
    """
    scene = chosen(scenario, set_, cycles)
    if controller is not None:
        scene = with_controller(scene, controller)
    axes, longest = read_axes(axis), seconds(limit, "--limit")
    picture = check_results(output, plot=plot)
    out = Console(quiet=quiet)
    failure: RunError | None = None
    with grid_bar(out) as progress:
        try:
            dataset = trade(scene, axes, scene.run.cycles, limit=longest, progress=progress)
        except RunError as error:
            failure, dataset = error, error.dataset
    written = save_results(dataset, output, picture, save_work_precision)
    show_trade(out, dataset, every=all_)
    out.print(written, highlight=False, soft_wrap=True)
    if failure is not None:
        raise failure
