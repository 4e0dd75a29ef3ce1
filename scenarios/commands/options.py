"""Options that several commands have, and what their text says."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from cosim import UnitError, quantity
from scenarios.errors import ScenarioError
from scenarios.scene.catalogue import draft
from scenarios.scene.scenario import Scenario

ScenarioName = Annotated[str, Parameter(help="A name from `softbody list`, or a TOML file.")]

ControllerName = Annotated[
    str | None,
    Parameter(
        help="Another controller: a name from `softbody controller list`, an FMU, or a Python file."
    ),
]

Changes = Annotated[
    tuple[str, ...],
    Parameter(
        name="--set",
        negative=(),
        help='Change a value, such as --set forces.alpha=0.5 or --set "body.mass=0.4 kg". '
        "May be repeated.",
    ),
]

Output = Annotated[Path, Parameter(name=["--output", "-o"])]

OptionalOutput = Annotated[Path | None, Parameter(name=["--output", "-o"])]

Dataset = Annotated[
    Output,
    Parameter(help="The netCDF4 file to write; the picture gets the same name with .png."),
]

Plot = Annotated[bool, Parameter(help="Draw the picture.")]

Quiet = Annotated[bool, Parameter(negative=(), help="Print nothing but errors.")]

Flag = Annotated[bool, Parameter(negative=())]


def build_scenario(
    name: str,
    changes: Sequence[str] = (),
    cycles: str | None = None,
    controller: str | None = None,
) -> Scenario:
    """Build a scenario as ``--set``, ``--cycles`` and ``--controller`` want it.

    Raises
    ------
    ScenarioError
        If an assignment cannot be read, or the scenario does not take it.
    """
    scenario = draft(name)
    values: dict[str, Any] = dict(map(_assignment, changes))
    if changes and "title" not in values:
        # or a picture of another lung would bear this one's title
        values["title"] = f"{scenario.title}; {', '.join(changes)}"
    if cycles is not None:
        values.update([_assignment(f"run.cycles={cycles}")])
    scenario = scenario.changed(values)
    return (scenario if controller is None else scenario.with_controller(controller)).build()


def _assignment(text: str) -> tuple[str, Any]:
    """Split "path=value"; the value is TOML where it can be read so, and text otherwise."""
    path, equals, value = text.partition("=")
    if not equals or not path:
        raise ScenarioError(f"--set {text!r}: expected path=value, such as forces.alpha=0.5")
    try:
        return path.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return path.strip(), value.strip()


def read_seconds(text: str, option: str) -> float:
    """Read a time; `option` is for the message.

    Raises
    ------
    ScenarioError
        If it is none.
    """
    try:
        return quantity(text, "s")
    except UnitError as error:
        raise ScenarioError(f"{option}: {error}") from error


def read_whole(text: str, option: str) -> int:
    """Read a whole number; `option` is for the message.

    Raises
    ------
    ScenarioError
        If it is none.
    """
    if not text.strip().isdecimal():
        raise ScenarioError(f"{option} = {text!r}: expected a whole number")
    return int(text)
