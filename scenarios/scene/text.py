"""The text of a scenario: TOML, made when a dataset, a checkpoint or a file asks for it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from typing import Any

import tomli_w

from softbody_core.ground.parameters import quantities_of


def toml(tables: Mapping[str, Any], kinds: Iterable[tuple[str, type[Any]]]) -> str:
    """Write tables as TOML; a number that has a unit becomes text with that unit.

    Parameters
    ----------
    tables : mapping
        Of a scenario.
    kinds : iterable of (str, type)
        Path of each table that holds numbers with units, and the dataclass that has the units.
    """
    written = deepcopy(dict(tables))
    for path, kind in kinds:
        for table in _tables_at(written, path):
            for name, quantity in quantities_of(kind).items():
                if name in table and quantity.unit != "1":
                    table[name] = _with_unit(table[name], quantity.unit)
    return tomli_w.dumps(written)


def _tables_at(tables: dict[str, Any], path: str) -> Iterator[dict[str, Any]]:
    """Tables at a path: none, one, or a list of them."""
    inside: Any = tables
    for key in path.split("."):
        inside = inside.get(key) if isinstance(inside, dict) else None
    for table in inside if isinstance(inside, list) else [inside]:
        if isinstance(table, dict):
            yield table


def _with_unit(value: Any, unit: str) -> Any:
    if isinstance(value, list):
        return [_with_unit(part, unit) for part in value]
    return value if isinstance(value, str) else f"{value!r} {unit}"
