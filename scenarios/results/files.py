"""Where results go: found writable before a run, written at once after it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import xarray as xr

from scenarios.errors import OutputError
from softbody_core import SimulationError

_COMPRESSED = {"zlib": True, "complevel": 4}


def check_writable(path: Path, suffix: str) -> None:
    """Raise `OutputError` unless a file can be written at `path`, whose name ends in `suffix`.

    The suffix keeps a slip of the keyboard from overwriting a scenario, a surface or an FMU.
    """
    if path.is_dir():
        raise OutputError(
            f"output {path} is a folder; name a file in it, such as {path / f'out{suffix}'}"
        )
    if path.suffix != suffix:
        raise OutputError(f"output {path}: expected a name that ends in {suffix}")
    if not path.parent.is_dir():
        raise OutputError(f"output {path}: folder {path.parent} does not exist; make it first")
    if path.exists() and not os.access(path, os.W_OK):
        raise OutputError(f"output {path} exists and cannot be overwritten")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise OutputError(f"output {path} cannot be written: {error.strerror}") from error


@contextmanager
def replacing(path: Path, what: str = "output") -> Iterator[Path]:
    """Give a place beside `path` to write to; what is there becomes `path` when it is whole.

    Until then an older file at `path` stays as it is. Everything that writes files does it so.

    Parameters
    ----------
    path : Path
        The file.
    what : str
        What it is, for the message.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    partial = path.with_name(f".{path.stem}.{os.getpid()}.partial{path.suffix}")
    try:
        yield partial
        partial.replace(path)
    except SimulationError:
        raise
    except OSError as error:
        raise OutputError(f"{what} {path} cannot be written: {error.strerror or error}") from error
    finally:
        partial.unlink(missing_ok=True)


def save(dataset: xr.Dataset, path: Path) -> None:
    """Write a dataset as netCDF4.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    large = [name for name, variable in dataset.items() if "snapshot" in variable.dims]
    encoding = dict.fromkeys(large, _COMPRESSED)
    try:
        with replacing(path) as partial:
            dataset.to_netcdf(partial, engine="netcdf4", format="NETCDF4", encoding=encoding)
    except ValueError as error:  # a name or a value that no file takes
        raise OutputError(f"output {path} cannot be written: {error}") from error


def check_results(output: Path, *, plot: bool) -> Path | None:
    """Raise `OutputError` unless a dataset, and its picture if wanted, can be written.

    Returns
    -------
    Path or None
        Where the picture goes: beside the dataset. None if none is wanted.
    """
    check_writable(output, ".nc")
    if not plot:
        return None
    picture = output.with_suffix(".png")
    check_writable(picture, ".png")
    return picture


def save_results(
    dataset: xr.Dataset,
    output: Path,
    picture: Path | None,
    draw: Callable[[xr.Dataset, Path], None],
) -> str:
    """Write a dataset, and its picture where there is a place for it; say what was written."""
    save(dataset, output)
    if picture is None:
        return f"wrote {output}"
    with replacing(picture) as partial:
        draw(dataset, partial)
    return f"wrote {output} and {picture}"
