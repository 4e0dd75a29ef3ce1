"""The paper's statements beside what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from rich.console import Console
from rich.table import Table

from scenarios.errors import ScenarioError
from scenarios.reproduce.finding import Finding, Statement
from scenarios.reproduce.glass import BALL
from scenarios.reproduce.lungs import LUNGS
from scenarios.reproduce.scenes import Datasets

STATEMENTS: Final = (*BALL, *LUNGS)


@dataclass(frozen=True)
class Verdict:
    """A statement, and what was found of it."""

    statement: Statement
    finding: Finding


def judge(datasets: Datasets) -> list[Verdict]:
    """Look at each statement whose scenes are there, in the paper's order."""
    return [
        Verdict(statement, _find(statement, datasets))
        for statement in STATEMENTS
        if all(scene in datasets for scene in statement.scenes)
    ]


def _find(statement: Statement, datasets: Datasets) -> Finding:
    try:
        return statement.find(datasets)
    except ScenarioError as error:  # a run that is too short to say anything
        return Finding(f"cannot be measured: {error}", holds=False)


def markdown(verdicts: Sequence[Verdict]) -> str:
    """Write the table of statements."""
    lines = ["| where | the paper says | measured | holds |", "|---|---|---|---|"]
    lines += [
        f"| {v.statement.where} | {v.statement.says} | {v.finding.measured} | {_word(v)} |"
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
            v.statement.where, v.statement.says, v.finding.measured, f"[{style}]{_word(v)}[/]"
        )
    console.print(table)


def _word(verdict: Verdict) -> str:
    return "yes" if verdict.finding.holds else "no"
