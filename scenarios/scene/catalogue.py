"""The scenarios that ship, and how to load one by name or from a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cosim.errors import nearest
from scenarios.errors import ScenarioError
from scenarios.scene.parse import parse_draft, read_toml, variants_of
from scenarios.scene.scenario import Draft, Scenario

_FOLDER = Path(__file__).parents[1] / "library"
MESHES = Path(__file__).parents[1] / "meshes"


def names() -> list[str]:
    """Return the names of the scenarios that ship, variants included."""
    return sorted(_catalogue())


def _catalogue() -> dict[str, tuple[Path, str | None]]:
    """File and variant of each name: variant "a" of lung.toml is named lung-a."""
    catalogue: dict[str, tuple[Path, str | None]] = {}
    for path in _FOLDER.glob("*.toml"):
        catalogue[path.stem] = path, None
        for variant in variants_of(read_toml(path.stem, path.read_text(encoding="utf-8"))):
            catalogue[f"{path.stem}-{variant}"] = path, variant
    return catalogue


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
    name, catalogue = str(name_or_path), _catalogue()
    if name not in catalogue:
        raise ScenarioError(
            f"no scenario is named {name!r}; {nearest(name, catalogue)}. A file ends in .toml"
        )
    path, variant = catalogue[name]
    return parse_draft(name, path.read_text(encoding="utf-8"), _FOLDER, variant)
