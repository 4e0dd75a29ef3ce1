"""The command ``softbody reproduce``."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import xarray as xr
from cyclopts import Parameter
from rich.markup import escape
from rich.table import Table

from scenarios.commands.options import Changes, Flag, Output, Quiet, build_scenario
from scenarios.commands.terminal import Terminal
from scenarios.errors import OutputError, RunError, ScenarioError
from scenarios.results.files import replacing
from scenarios.results.rendering.render import renderer
from scenarios.running.progress import StudyProgress, Watch
from scenarios.studies.paper.scenes import STRIDES, Scenes
from scenarios.studies.paper.statements import JudgedStatement, judge, markdown
from scenarios.studies.paper.targets import ALL, Target, choose_targets

EveryScene = Annotated[
    Changes,
    Parameter(
        help="Change a value in every scene, such as --set mesh.lung=lung-right-770 for a quick "
        "look. May be repeated."
    ),
]


def reproduce_(
    *names: str,
    output: Output = Path("reproduced"),
    set_: EveryScene = (),
    cycles: str | None = None,
    fresh: Flag = False,
    quiet: Quiet = False,
) -> None:
    """Write the paper's figures and tables, and what becomes of its statements.

    Parameters
    ----------
    names
        figure-1 to figure-12, table-1 to table-3, or all, which is what none means too.
    output
        The folder for pictures, tables, statements.md, and the dataset of each scene. A scene whose
        dataset is there is not run again, unless its text or a library's version has changed.
    cycles
        Number of breaths in every scene.
    fresh
        Run every scene, whatever the folder holds.
    """
    targets = choose_targets(names or [ALL])
    _check_folder(output)
    if any(target.rendered for target in targets.values()):
        renderer()
    terminal = Terminal(quiet=quiet)
    scenes = Scenes(output, lambda name: build_scenario(name, set_, cycles), fresh=fresh)
    with terminal.study_bar(transient=True) as watch:
        scenes.get_all([scene for target in targets.values() for scene in target.scenes], watch)
        missing = _write(targets, scenes, watch)
    settings = [*set_, *([f"run.cycles={cycles}"] if cycles is not None else [])]
    _report(terminal, scenes, settings)
    written = ", ".join([*(name for name in targets if name not in missing), "statements"])
    terminal.line(f"wrote {written} to {output}")
    if missing:
        raise _failure(scenes, missing)


def _write(targets: Mapping[str, Target], scenes: Scenes, watch: Watch) -> dict[str, str]:
    """Write each target whose scenes are there; return why the others are not written."""
    missing: dict[str, str] = {}
    for i, (name, target) in enumerate(targets.items()):
        watch(StudyProgress(f"drawing {name}", i / len(targets), 1))
        failed = [scene for scene in target.scenes if scene in scenes.failures]
        if failed:
            missing[name] = f"without {', '.join(failed)}"
            continue
        try:
            with replacing(scenes.folder / f"{name}{target.suffix}") as path:
                target.write(scenes.datasets, path)
        except ScenarioError as error:
            missing[name] = str(error)
    return missing


def _report(terminal: Terminal, scenes: Scenes, settings: Sequence[str]) -> None:
    """Write and print what becomes of the paper's statements."""
    judged = judge({**scenes.datasets, **_from_before(scenes)}, scenes.failures)
    note = f"With other settings than the paper's: {', '.join(settings)}" if settings else ""
    with replacing(scenes.folder / "statements.md") as path:
        path.write_text(f"{note}\n\n" * bool(note) + markdown(judged), encoding="utf-8")
    if note:
        terminal.line(note)
    if judged:
        terminal.show(table_of(judged))


def table_of(judged: Sequence[JudgedStatement]) -> Table:
    """Statements beside what was measured, for the terminal."""
    table = Table(title="The paper's statements", show_lines=True)
    for heading in ("where", "the paper says", "measured"):
        table.add_column(heading, overflow="fold")
    table.add_column("holds", justify="center")
    for entry in judged:
        statement, style = entry.statement, "green" if entry.measurement.holds else "red"
        measured = escape(entry.measurement.measured)
        table.add_row(statement.where, statement.says, measured, f"[{style}]{entry.answer}[/]")
    return table


def _from_before(scenes: Scenes) -> dict[str, xr.Dataset]:
    """Scenes that nobody asked for now, but whose datasets are there: for the statements."""
    others = [name for name in STRIDES if name not in {*scenes.datasets, *scenes.failures}]
    datasets = {name: scenes.look(name) for name in others}
    return {name: dataset for name, dataset in datasets.items() if dataset is not None}


def _failure(scenes: Scenes, missing: Mapping[str, str]) -> RunError:
    reasons = [f"scene {name} failed: {error}" for name, error in scenes.failures.items()]
    reasons += [f"{name} is not written: {reason}" for name, reason in missing.items()]
    datasets = (e.dataset for e in scenes.failures.values() if isinstance(e, RunError))
    return RunError("; ".join(reasons), next(datasets, xr.Dataset()))


def _check_folder(folder: Path) -> None:
    """Make the folder; raise `OutputError` unless files can be written in it."""
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"output {folder} is a file; name a folder")
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"output {folder} cannot be written: {error.strerror or error}"
        ) from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"output {folder}: nothing can be written in this folder")
