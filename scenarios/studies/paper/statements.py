"""The paper's statements beside what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import shorten
from typing import Final

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from scenarios.errors import ScenarioError
from scenarios.studies.paper.finding import Finding, Statement
from scenarios.studies.paper.glass import BALL
from scenarios.studies.paper.lungs import LUNGS
from scenarios.studies.paper.scenes import Datasets
from softbody_core.ground.errors import SimulationError

STATEMENTS: Final = (*BALL, *LUNGS)
_REASON: Final = 100
"""Letters of the reason why a scene failed; the command's error has all of them."""


@dataclass(frozen=True)
class Verdict:
    """A statement, and what was found of it."""

    statement: Statement
    finding: Finding


def judge(datasets: Datasets, failures: Mapping[str, SimulationError]) -> list[Verdict]:
    """Look at each statement whose scenes are there, or one of whose scenes failed.

    Parameters
    ----------
    datasets : mapping of str to xr.Dataset
        What has come of the scenes.
    failures : mapping of str to SimulationError
        Why a scene has no dataset. No statement on such a scene holds.

    Returns
    -------
    list of Verdict
        In the paper's order, without the statements whose scenes nobody asked for.
    """
    return [
        Verdict(statement, _find(statement, datasets, failures))
        for statement in STATEMENTS
        if any(scene in failures for scene in statement.scenes)
        or all(scene in datasets for scene in statement.scenes)
    ]


def _find(
    statement: Statement, datasets: Datasets, failures: Mapping[str, SimulationError]
) -> Finding:
    failed = [
        f"{scene} failed: {shorten(str(failures[scene]), _REASON, placeholder=' …')}"
        for scene in statement.scenes
        if scene in failures
    ]
    if failed:
        return Finding("; ".join(failed), holds=False)
    try:
        return statement.find(datasets)
    except ScenarioError as error:  # a run that is too short to say anything
        return Finding(f"cannot be measured: {error}", holds=False)


def markdown(verdicts: Sequence[Verdict]) -> str:
    """Write the table of statements."""
    lines = ["| where | the paper says | measured | holds |", "|---|---|---|---|"]
    lines += [
        f"| {v.statement.where} | {v.statement.says} | {_cell(v.finding.measured)} | {_word(v)} |"
        for v in verdicts
    ]
    return "\n".join([*lines, ""])


def show(console: Console, verdicts: Sequence[Verdict]) -> None:
    """Print the table of statements."""
    if not verdicts:
        return
    table = Table(title="The paper's statements", show_lines=True)
    for heading in ("where", "the paper says", "measured"):
        table.add_column(heading, overflow="fold")
    table.add_column("holds", justify="center")
    for v in verdicts:
        style = "green" if v.finding.holds else "red"
        table.add_row(
            v.statement.where,
            v.statement.says,
            escape(v.finding.measured),
            f"[{style}]{_word(v)}[/]",
        )
    console.print(table)


def _cell(text: str) -> str:
    """Keep a reason that has a bar in it within its cell."""
    return text.replace("|", r"\|")


def _word(verdict: Verdict) -> str:
    return "yes" if verdict.finding.holds else "no"
