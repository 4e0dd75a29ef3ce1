"""The command ``softbody run``."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from scenarios.commands.options import (
    Changes,
    ControllerName,
    Dataset,
    Plot,
    Quiet,
    ScenarioName,
    build_scenario,
    read_seconds,
    read_whole,
)
from scenarios.commands.run_report import show_controller, show_run, show_warnings
from scenarios.commands.terminal import Terminal
from scenarios.commands.trade_report import show_pick
from scenarios.errors import RunError
from scenarios.results.files import check_results, save_results
from scenarios.results.plots import save_overview
from scenarios.running.checkpoint import SUFFIX, Checkpoints
from scenarios.running.run import run
from scenarios.scene.scenario import Scenario
from scenarios.studies.accuracy import pick

_TOO_EARLY: Final = "the run ended before its first checkpoint, so there is nothing to resume"


def run_(
    scenario: ScenarioName,
    /,
    *,
    controller: ControllerName = None,
    set_: Changes = (),
    cycles: str | None = None,
    accuracy: float | None = None,
    output: Dataset = Path("out.nc"),
    positions: str | None = None,
    checkpoint: str | None = None,
    plot: Plot = True,
    quiet: Quiet = False,
) -> None:
    """Run a scenario; write a dataset and a picture beside it.

    Parameters
    ----------
    cycles
        Number of breaths.
    accuracy
        Pick the cheapest integrator that keeps the volume within this share of its range, such as
        1e-3, by trying some on the first breath.
    positions
        Keep all point positions at this interval, such as "0.1 s".
    checkpoint
        Every so many communication steps, write what `softbody resume` goes on from, to a file
        with the output's name and .checkpoint. It is removed when the run is complete.
    """
    scene = build_scenario(scenario, set_, cycles, controller)
    every = None if positions is None else read_seconds(positions, "--positions")
    picture = check_results(output, plot=plot)
    terminal = Terminal(quiet=quiet)
    extra: dict[str, Any] = {}
    if accuracy is not None:
        scene, extra = _pick(terminal, scene, accuracy)
    checkpoints = _checkpoints(output, checkpoint, extra)
    failure: RunError | None = None
    with terminal.run_bar() as progress:
        try:
            dataset = run(scene, positions_every=every, checkpoints=checkpoints, progress=progress)
        except RunError as error:
            failure, dataset = error, error.dataset
    written = save_results(dataset.assign_attrs(extra), output, picture, save_overview)
    show_run(terminal, dataset)
    if scene.controller is not None:
        show_controller(terminal, scene.controller, scene.run.period)
    show_warnings(terminal, dataset)
    terminal.line(written)
    if checkpoints is not None:
        _leave(terminal, checkpoints.path, complete=failure is None)
    if failure is not None:
        raise failure


def _pick(
    terminal: Terminal, scenario: Scenario, accuracy: float
) -> tuple[Scenario, dict[str, Any]]:
    """Give the scenario the cheapest integrator that is accurate enough, and say which."""
    with terminal.study_bar(transient=True) as trying:
        picked = pick(scenario, accuracy, progress=trying)
    show_pick(terminal, picked, accuracy)
    return picked.scenario, {"accuracy_asked": accuracy, "error_estimate": picked.error}


def _leave(terminal: Terminal, checkpoint: Path, *, complete: bool) -> None:
    """Remove the checkpoint of a run that is complete, and say of another how to go on with it."""
    if complete:
        checkpoint.unlink(missing_ok=True)
    elif checkpoint.exists():
        terminal.line(f"go on with: softbody resume {checkpoint}")
    else:
        terminal.line(_TOO_EARLY)


def _checkpoints(output: Path, every: str | None, extra: dict[str, Any]) -> Checkpoints | None:
    if every is None:
        return None
    return Checkpoints(output.with_suffix(SUFFIX), read_whole(every, "--checkpoint"), extra)
