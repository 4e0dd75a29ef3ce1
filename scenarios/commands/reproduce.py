"""The command ``softbody reproduce``."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import xarray as xr
from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from scenarios.errors import OutputError, RunError, ScenarioError
from scenarios.results.rendering.render import renderer
from scenarios.studies.paper.scenes import STRIDES, Scenes, Tell
from scenarios.studies.paper.statements import judge, markdown, show
from scenarios.studies.paper.targets import ALL, Target, asked


def reproduce_(
    *names: str,
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("reproduced"),
    set_: Annotated[tuple[str, ...], Parameter(name="--set", negative=())] = (),
    cycles: str | None = None,
    fresh: Annotated[bool, Parameter(negative=())] = False,
    quiet: Annotated[bool, Parameter(negative=())] = False,
) -> None:
    """Write the paper's figures and tables, and what becomes of its statements.

    Parameters
    ----------
    names
        figure-1 to figure-12, table-1 to table-3, or all, which is what none means too.
    output
        The folder for pictures, tables, statements.md, and the dataset of each scene. A scene whose
        dataset is there is not run again, unless its text or a library's version has changed.
    set_
        Change a value in every scene, such as --set mesh.lung=lung-right-770 for a quick look.
    cycles
        Number of breaths in every scene.
    fresh
        Run every scene, whatever the folder holds.
    quiet
        Print nothing but errors.
    """
    targets = asked(names or [ALL])
    _check_folder(output)
    if any(target.rendered for target in targets.values()):
        renderer()
    out = Console(quiet=quiet)
    scenes = Scenes(output, set_, cycles, fresh)
    needed = list(dict.fromkeys(scene for t in targets.values() for scene in t.scenes))
    scenes.check(needed)
    with _bar(out) as tell:
        for name in needed:
            scenes.get(name, tell)
        missing = _write(targets, scenes, tell)
    known = {**scenes.datasets, **_from_before(scenes)}
    verdicts = judge(known, scenes.failures)
    path = output / "statements.md"
    settings = [*set_, *([f"run.cycles={cycles}"] if cycles is not None else [])]
    note = f"With other settings than the paper's: {', '.join(settings)}\n\n" if settings else ""
    _written(path, lambda: path.write_text(note + markdown(verdicts), encoding="utf-8"))
    out.print(note.rstrip(), highlight=False, markup=False, end="\n" if note else "")
    show(out, verdicts)
    out.print(
        f"wrote {', '.join([*(n for n in targets if n not in missing), 'statements'])} to {output}",
        highlight=False,
        soft_wrap=True,
    )
    if missing:
        raise _failure(scenes, missing)


def _write(targets: Mapping[str, Target], scenes: Scenes, tell: Tell) -> dict[str, str]:
    """Write each target whose scenes are there; return why the others are not written."""
    missing: dict[str, str] = {}
    for i, (name, target) in enumerate(targets.items()):
        tell(f"drawing {name}", i / len(targets))
        failed = [scene for scene in target.scenes if scene in scenes.failures]
        path = scenes.folder / f"{name}{target.suffix}"
        if failed:
            missing[name] = f"without {', '.join(failed)}"
            continue
        try:
            _written(path, lambda: target.write(scenes.datasets, path))  # noqa: B023 - called now
        except ScenarioError as error:
            missing[name] = str(error)
    return missing


def _from_before(scenes: Scenes) -> dict[str, xr.Dataset]:
    """Scenes that nobody asked for now, but whose datasets are there: for the statements."""
    others = [name for name in STRIDES if name not in {*scenes.datasets, *scenes.failures}]
    found = {name: scenes.look(name) for name in others}
    return {name: dataset for name, dataset in found.items() if dataset is not None}


def _failure(scenes: Scenes, missing: Mapping[str, str]) -> RunError:
    told = [f"scene {name} failed: {error}" for name, error in scenes.failures.items()]
    told += [f"{name} is not written: {reason}" for name, reason in missing.items()]
    datasets = (e.dataset for e in scenes.failures.values() if isinstance(e, RunError))
    return RunError("; ".join(told), next(datasets, xr.Dataset()))


def _check_folder(folder: Path) -> None:
    """Make the folder; raise `OutputError` unless files can be written in it."""
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"output {folder} is a file; name a folder")
    _written(folder, lambda: folder.mkdir(exist_ok=True))
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"output {folder}: nothing can be written in this folder")


def _written(path: Path, write: Callable[[], object]) -> None:
    try:
        write()
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"output {path} cannot be written: {error.strerror or error}") from error


@contextmanager
def _bar(console: Console) -> Iterator[Tell]:
    columns = (BarColumn(bar_width=30), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, disable=console.quiet, transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda text, share: bar.update(task, description=text, completed=share)
