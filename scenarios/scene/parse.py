"""From TOML text to a scenario; the variants that are in it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scenarios.errors import ScenarioError
from scenarios.scene.scenario import Draft, Scenario
from scenarios.scene.tables import choose, table


def parse(name: str, text: str, folder: Path, changes: Mapping[str, Any] | None = None) -> Scenario:
    """Make a scenario of TOML text.

    Parameters
    ----------
    name, text, folder
        As in `parse_draft`.
    changes : mapping, optional
        Values to put in place first, by dotted path: ``{"forces.alpha": 0.5}``.

    Raises
    ------
    ScenarioError
        With the path of the bad field.
    """
    return parse_draft(name, text, folder).changed(changes or {}).build()


def parse_draft(name: str, text: str, folder: Path, variant: str | None = None) -> Draft:
    """Read TOML text, and look no further into it.

    Parameters
    ----------
    name : str
        For messages and datasets.
    text : str
        TOML.
    folder : Path
        Against which relative paths are read.
    variant : str, optional
        Key in the table ``variants`` whose changes are put in place.

    Raises
    ------
    ScenarioError
        If it is no TOML, or has no such variant.
    """
    tables = read_toml(name, text)
    variants = variants_of(tables)
    tables.pop("variants", None)
    draft = Draft(name, folder, tables, text)
    return draft if variant is None else draft.changed(choose(variant, variants, "variant"))


def read_toml(name: str, text: str) -> dict[str, Any]:
    """Read TOML text; `name` is for the message."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"scenario {name} is no valid TOML: {error}") from error


def variants_of(tables: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Tables of changes, by dotted path, that make a family of one scenario."""
    variants = table(tables.get("variants", {}), "variants")
    return {key: table(value, f"variants.{key}") for key, value in variants.items()}
