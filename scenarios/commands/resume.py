"""The command ``softbody resume``."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from scenarios.commands.options import OptionalOutput, Plot, Quiet
from scenarios.commands.run_report import show_run, show_warnings
from scenarios.commands.terminal import Terminal
from scenarios.errors import OutputError, RunError
from scenarios.results.files import check_results, save_results
from scenarios.results.plots import save_overview
from scenarios.running.run import COMPLETED, resume


def resume_(
    checkpoint: Path,
    /,
    *,
    output: OptionalOutput = None,
    plot: Plot = True,
    quiet: Quiet = False,
) -> None:
    """Go on with a run that was cut off, from its last checkpoint.

    The dataset is the one that the run would have given, to the bit. Checkpoints go on, too.

    Parameters
    ----------
    checkpoint
        What `softbody run … --checkpoint N` left behind: out.checkpoint.
    output
        The netCDF4 file to write; by default the checkpoint's name with .nc.
    """
    path = output if output is not None else checkpoint.with_suffix(".nc")
    if output is None and _is_complete(path):
        raise OutputError(
            f"output {path} holds a run that was completed since; name another file with -o"
        )
    picture = check_results(path, plot=plot)
    terminal = Terminal(quiet=quiet)
    failure: RunError | None = None
    with terminal.run_bar() as progress:
        try:
            dataset = resume(checkpoint, progress=progress)
        except RunError as error:
            failure, dataset = error, error.dataset
    written = save_results(dataset, path, picture, save_overview)
    show_run(terminal, dataset)
    show_warnings(terminal, dataset)
    terminal.line(written)
    if failure is not None:
        raise failure
    checkpoint.unlink(missing_ok=True)


def _is_complete(path: Path) -> bool:
    """Whether a file is the dataset of a run that came to its end."""
    try:
        with xr.open_dataset(path, engine="netcdf4") as dataset:
            return dataset.attrs.get("status") == COMPLETED
    except (OSError, ValueError):  # none, or no dataset
        return False
