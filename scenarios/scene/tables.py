"""Plain tables, as TOML has them: what is expected in them, and how they are changed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from typing import Any, TypeVar

import numpy as np

from cosim.errors import nearest
from scenarios.errors import ScenarioError

T = TypeVar("T")


def table(value: object, path: str) -> dict[str, Any]:
    """Return `value` if it is a table."""
    if not isinstance(value, dict):
        raise ScenarioError(f"{path} = {value!r}: expected a table")
    return value


def choose(name: object, choices: Mapping[str, T], path: str) -> T:
    """Pick from a table of names."""
    if not isinstance(name, str) or name not in choices:
        raise ScenarioError(f"{path} = {name!r}: {nearest(str(name), choices)}")
    return choices[name]


def refuse_unknown(data: Iterable[str], known: Iterable[str], path: str) -> None:
    """Raise for the first key that is not among the known ones."""
    names = list(known)
    for key in data:
        if key not in names:
            raise ScenarioError(f"{join(path, key)} is unknown; {nearest(key, names)}")


def join(path: str, key: str) -> str:
    """Path of a key in the table at `path`; the whole scenario's path is empty."""
    return f"{path}.{key}".strip(".")


def with_values(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Copy tables with values put in place by dotted path, ``{"forces.alpha": 0.5}``."""
    changed = deepcopy(dict(tables))
    for path, value in changes.items():
        *parents, last = path.split(".")
        inside = changed
        for depth, key in enumerate(parents, start=1):
            inside = table(inside.setdefault(key, {}), ".".join(parents[:depth]))
        # TOML has no NumPy, and a table that was handed in is its owner's
        inside[last] = value.item() if isinstance(value, np.generic) else deepcopy(value)
    return changed


def merge(shared: Mapping[str, Any], special: Mapping[str, Any]) -> dict[str, Any]:
    """Merge tables, value by value; where both have a value, the special one counts."""
    merged = deepcopy(dict(shared))
    for key, value in special.items():
        inside = merged.get(key)
        if isinstance(inside, dict) and isinstance(value, dict):
            merged[key] = merge(inside, value)
        else:
            merged[key] = deepcopy(value)
    return merged
