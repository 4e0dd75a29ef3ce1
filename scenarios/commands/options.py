"""What options of the command line say, as values."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import Any

from cosim import UnitError, quantity
from scenarios.errors import ScenarioError
from scenarios.scene.catalogue import load
from scenarios.scene.scenario import Scenario


def chosen(scenario: str, assignments: Sequence[str], cycles: str | None = None) -> Scenario:
    """Load a scenario with the changes that ``--set`` and ``--cycles`` ask for.

    Raises
    ------
    ScenarioError
        If an assignment cannot be read, or the scenario does not take it.
    """
    changes: dict[str, Any] = dict(map(_assignment, assignments))
    if cycles is not None:
        changes.update([_assignment(f"run.cycles={cycles}")])
    loaded = load(scenario, changes)
    if not assignments or "title" in changes:
        return loaded
    # or a picture of another lung would bear this one's title
    return loaded.changed({"title": f"{loaded.title}; {', '.join(assignments)}"})


def _assignment(text: str) -> tuple[str, Any]:
    """Split "path=value"; the value is TOML where it can be read so, and text otherwise."""
    path, equals, value = text.partition("=")
    if not equals or not path:
        raise ScenarioError(f"--set {text!r}: expected path=value, such as forces.alpha=0.5")
    try:
        return path.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return path.strip(), value.strip()


def seconds(text: str, option: str) -> float:
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


def whole(text: str, option: str) -> int:
    """Read a whole number; `option` is for the message.

    Raises
    ------
    ScenarioError
        If it is none.
    """
    if not text.strip().isdecimal():
        raise ScenarioError(f"{option} = {text!r}: expected a whole number")
    return int(text)
