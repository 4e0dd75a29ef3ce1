"""The command ``softbody resume``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import xarray as xr
from cyclopts import Parameter
from rich.console import Console

from scenarios.commands.terminal import progress_bar, show_breaths, show_shape, show_warnings
from scenarios.errors import OutputError, RunError
from scenarios.results.files import check_results, save_results
from scenarios.results.plots import save_overview
from scenarios.running.run import COMPLETED, resume


def resume_(
    checkpoint: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    plot: bool = True,
    quiet: Annotated[bool, Parameter(negative=())] = False,
) -> None:
    """Go on with a run that was cut off, from its last checkpoint.

    The dataset is the one that the run would have given, to the bit. Checkpoints go on, too.

    Parameters
    ----------
    checkpoint
        What `softbody run … --checkpoint N` left behind: out.checkpoint.
    output
        The netCDF4 file to write; by default the checkpoint's name with .nc.
    plot
        Draw the picture.
    quiet
        Print nothing but errors.
    """
    path = output if output is not None else checkpoint.with_suffix(".nc")
    if output is None and _is_complete(path):
        raise OutputError(
            f"output {path} holds a run that was completed since; name another file with -o"
        )
    picture = check_results(path, plot=plot)
    out = Console(quiet=quiet)
    failure: RunError | None = None
    with progress_bar(out) as progress:
        try:
            dataset = resume(checkpoint, progress=progress)
        except RunError as error:
            failure, dataset = error, error.dataset
    written = save_results(dataset, path, picture, save_overview)
    if "controller" in dataset.attrs:
        show_breaths(out, dataset)
    else:
        show_shape(out, dataset)
    show_warnings(out, dataset)
    out.print(written, highlight=False, soft_wrap=True)
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
