"""The scenarios and surfaces that ship. Nothing heavy is imported to list them."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Final, NamedTuple

_PACKAGE: Final = Path(__file__).parents[1]
LIBRARY: Final = _PACKAGE / "library"
MESHES: Final = _PACKAGE / "meshes"


class Shipped(NamedTuple):
    """A scenario that ships.

    Attributes
    ----------
    path : Path
        Its file.
    variant : str or None
        Its table of changes in that file, if it is a variant.
    title : str
        What it is.
    """

    path: Path
    variant: str | None
    title: str


def shipped() -> dict[str, Shipped]:
    """Return what ships, by name: variant "a" of lung.toml is named lung-a."""
    scenarios: dict[str, Shipped] = {}
    for path in LIBRARY.glob("*.toml"):
        data = tomllib.loads(path.read_text(encoding="utf-8"))
        scenarios[path.stem] = Shipped(path, None, data["title"])
        for variant, changes in data.get("variants", {}).items():
            title = changes.get("title", data["title"])
            scenarios[f"{path.stem}-{variant}"] = Shipped(path, variant, title)
    return scenarios


def names() -> list[str]:
    """Return the names of the scenarios that ship, variants included."""
    return sorted(shipped())
