"""The paper's statements beside what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import shorten
from typing import Final

from scenarios.errors import ScenarioError
from scenarios.studies.paper.glass import BALL
from scenarios.studies.paper.lungs import LUNGS
from scenarios.studies.paper.measurement import Measurement, Statement
from scenarios.studies.paper.scenes import Datasets
from softbody_core.ground.errors import SimulationError

STATEMENTS: Final = (*BALL, *LUNGS)
_REASON: Final = 100
"""Letters of the reason why a scene failed; the command's error has all of them."""


@dataclass(frozen=True)
class JudgedStatement:
    """A statement, what was measured of it, and whether it holds."""

    statement: Statement
    measurement: Measurement

    @property
    def answer(self) -> str:
        """Whether it holds, in a word."""
        return "yes" if self.measurement.holds else "no"


def judge(datasets: Datasets, failures: Mapping[str, SimulationError]) -> list[JudgedStatement]:
    """Look at each statement whose scenes are there, or one of whose scenes failed.

    Parameters
    ----------
    datasets : mapping of str to xr.Dataset
        What has come of the scenes.
    failures : mapping of str to SimulationError
        Why a scene has no dataset. No statement on such a scene holds.

    Returns
    -------
    list of JudgedStatement
        In the paper's order, without the statements whose scenes nobody asked for.
    """
    return [
        JudgedStatement(statement, _measure(statement, datasets, failures))
        for statement in STATEMENTS
        if any(scene in failures for scene in statement.scenes)
        or all(scene in datasets for scene in statement.scenes)
    ]


def _measure(
    statement: Statement, datasets: Datasets, failures: Mapping[str, SimulationError]
) -> Measurement:
    failed = [
        f"{scene} failed: {shorten(str(failures[scene]), _REASON, placeholder=' …')}"
        for scene in statement.scenes
        if scene in failures
    ]
    if failed:
        return Measurement("; ".join(failed), holds=False)
    try:
        return statement.measure(datasets)
    except ScenarioError as error:  # a run that is too short to say anything
        return Measurement(f"cannot be measured: {error}", holds=False)


def markdown(judged: Sequence[JudgedStatement]) -> str:
    """Write the table of statements."""
    lines = ["| where | the paper says | measured | holds |", "|---|---|---|---|"]
    lines += [
        f"| {statement.where} | {statement.says} | {_cell(measured)} | {entry.answer} |"
        for entry in judged
        for statement, measured in [(entry.statement, entry.measurement.measured)]
    ]
    return "\n".join([*lines, ""])


def _cell(text: str) -> str:
    """Keep a reason that has a bar in it within its cell."""
    return text.replace("|", r"\|")
