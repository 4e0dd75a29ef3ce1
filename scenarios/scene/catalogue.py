"""Scenarios by name or from a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cosim.errors import nearest
from scenarios.errors import ScenarioError
from scenarios.scene.parse import parse_draft
from scenarios.scene.scenario import Draft, Scenario
from scenarios.scene.shipped import LIBRARY, shipped


def load(name_or_path: str | Path, changes: Mapping[str, Any] | None = None) -> Scenario:
    """Load a scenario that ships, or one from a TOML file.

    Parameters
    ----------
    name_or_path : str or Path
        A name, such as ``"lung"``, or a file that ends in ``.toml``.
    changes : mapping, optional
        Values to put in place, by dotted path: ``{"forces.alpha": 0.5}``.

    Returns
    -------
    Scenario
        Validated and frozen.

    Raises
    ------
    ScenarioError
        If there is no such scenario, or it is not as expected.
    """
    return draft(name_or_path).changed(changes or {}).build()


def draft(name_or_path: str | Path) -> Draft:
    """Read the tables of a scenario; see `load`."""
    path = Path(name_or_path)
    if path.suffix == ".toml":
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or "it is no UTF-8 text"
            raise ScenarioError(f"scenario {path} cannot be read: {reason}") from error
        return parse_draft(path.stem, text, path.resolve().parent)
    name, catalogue = str(name_or_path), shipped()
    if name not in catalogue:
        raise ScenarioError(
            f"no scenario is named {name!r}; {nearest(name, catalogue)}. A file ends in .toml"
        )
    path, variant, _ = catalogue[name]
    return parse_draft(name, path.read_text(encoding="utf-8"), LIBRARY, variant)
