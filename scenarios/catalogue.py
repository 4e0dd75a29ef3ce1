"""The scenarios that ship, and how to load one by name or from a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cosim.errors import nearest
from scenarios.errors import ScenarioError
from scenarios.schema import Scenario, parse

_FOLDER = Path(__file__).with_name("library")
MESHES = Path(__file__).with_name("meshes")


def names() -> list[str]:
    """Return the names of the scenarios that ship."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml"))


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
    path = Path(name_or_path)
    if path.suffix == ".toml":
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ScenarioError(f"scenario {path} cannot be read: {error}") from error
        return parse(path.stem, text, path.resolve().parent, changes)
    name = str(name_or_path)
    if name not in names():
        raise ScenarioError(
            f"no scenario is named {name!r}; {nearest(name, names())}. A file ends in .toml"
        )
    text = (_FOLDER / f"{name}.toml").read_text(encoding="utf-8")
    return parse(name, text, _FOLDER, changes)
