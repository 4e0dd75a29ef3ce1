"""The command ``softbody run``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

from cyclopts import Parameter
from rich.console import Console

from scenarios.commands.options import chosen, seconds, whole
from scenarios.commands.terminal import (
    progress_bar,
    show_breaths,
    show_controller,
    show_shape,
    show_warnings,
)
from scenarios.commands.trade_report import show_pick, trial_bar
from scenarios.errors import RunError
from scenarios.results.files import check_results, save_results
from scenarios.results.plots import save_overview
from scenarios.running.checkpoint import SUFFIX, Checkpoints
from scenarios.running.run import run, with_controller
from scenarios.studies.accuracy import pick

_TOO_EARLY: Final = "the run ended before its first checkpoint, so there is nothing to resume"


def run_(
    scenario: str,
    /,
    *,
    controller: str | None = None,
    set_: Annotated[tuple[str, ...], Parameter(name="--set", negative=())] = (),
    cycles: str | None = None,
    accuracy: float | None = None,
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("out.nc"),
    positions: str | None = None,
    checkpoint: str | None = None,
    plot: bool = True,
    quiet: Annotated[bool, Parameter(negative=())] = False,
) -> None:
    """Run a scenario; write a dataset and a picture beside it.

    Parameters
    ----------
    scenario
        A name from `softbody list`, or a TOML file.
    controller
        Another controller: a name from `softbody controller list`, an FMU, or a Python file.
    set_
        Change a value, such as --set forces.alpha=0.5 or --set "body.mass=0.4 kg". May be repeated.
    cycles
        Number of breaths.
    accuracy
        Pick the cheapest integrator that keeps the volume within this share of its range, such as
        1e-3, by trying some on the first breath.
    output
        The netCDF4 file to write; the picture gets the same name with .png.
    positions
        Keep all point positions at this interval, such as "0.1 s".
    checkpoint
        Every so many communication steps, write what `softbody resume` goes on from, to a file
        with the output's name and .checkpoint. It is removed when the run is complete.
    plot
        Draw the picture.
    quiet
        Print nothing but errors.
    """
    scene = chosen(scenario, set_, cycles)
    every = None if positions is None else seconds(positions, "--positions")
    picture = check_results(output, plot=plot)
    out = Console(quiet=quiet)
    if controller is not None:
        scene = with_controller(scene, controller)
    attributes = {}
    if accuracy is not None:
        with trial_bar(out) as trying:
            picked = pick(scene, accuracy, progress=trying)
        scene = picked.scenario
        attributes = {"accuracy_asked": accuracy, "error_estimate": picked.error}
        show_pick(out, picked, accuracy)
    checkpoints: Checkpoints | None = None
    if checkpoint is not None:
        steps = whole(checkpoint, "--checkpoint")
        checkpoints = Checkpoints(output.with_suffix(SUFFIX), steps, attributes)
    failure: RunError | None = None
    with progress_bar(out) as progress:
        try:
            dataset = run(scene, positions_every=every, checkpoints=checkpoints, progress=progress)
        except RunError as error:
            failure, dataset = error, error.dataset
    dataset.attrs |= attributes
    written = save_results(dataset, output, picture, save_overview)
    if scene.controller is None:
        show_shape(out, dataset)
    else:
        show_breaths(out, dataset)
        show_controller(out, scene.controller, scene.run.period)
    show_warnings(out, dataset)
    out.print(written, highlight=False, soft_wrap=True)
    if failure is not None and checkpoints is not None:
        there = checkpoints.path.exists()
        said = f"go on with: softbody resume {checkpoints.path}" if there else _TOO_EARLY
        out.print(said, highlight=False, soft_wrap=True)
    if failure is not None:
        raise failure
    if checkpoints is not None:
        checkpoints.path.unlink(missing_ok=True)
