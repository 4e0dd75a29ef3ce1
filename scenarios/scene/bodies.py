"""The tables ``[bodies.x]``: several bodies, each with its own changes to what they share."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from typing import Any, Final

from scenarios.errors import ScenarioError
from scenarios.scene.decode import refuse_unknown, table

_OWN: Final = ("mesh", "body", "forces", "constraints", "integrator")
"""Tables that a body may have of its own."""

_NAME: Final = re.compile(r"[a-z][a-z0-9]*")
_TAKEN: Final = ("body", "controller")


def members(data: Mapping[str, Any], known: Sequence[str]) -> dict[str, dict[str, Any]]:
    """TOML data of each body: what is shared, with the body's own values in place.

    Parameters
    ----------
    data : mapping
        Of the scenario, with a table ``bodies``.
    known : sequence of str
        Tables that a scenario may have.

    Raises
    ------
    ScenarioError
        For fewer than two bodies, a name that does not do, or a table that bodies share.
    """
    refuse_unknown(data, ["title", "bodies", *known], "")
    own = table(data["bodies"], "bodies")
    if len(own) < 2:
        raise ScenarioError(
            f"bodies: expected two tables or more, like [bodies.left] and [bodies.right]; got "
            f"{', '.join(own) or 'none'}. One body needs no table of its own"
        )
    if "obstacles" in data:
        raise ScenarioError("obstacles: a scenario with several bodies takes none")
    shared = {key: value for key, value in data.items() if key != "bodies"}
    found = {}
    for name, changes in own.items():
        if not _NAME.fullmatch(name) or name in _TAKEN:
            raise ScenarioError(
                f"bodies.{name}: expected a name of small letters and digits, other than "
                f"{' and '.join(_TAKEN)}: the variables of the dataset begin with it"
            )
        refuse_unknown(table(changes, f"bodies.{name}"), list(_OWN), f"bodies.{name}")
        found[name] = _merged(shared, changes)
    return found


def _merged(shared: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of both, value by value; where both have a value, the body's own."""
    merged = deepcopy(dict(shared))
    for key, value in own.items():
        inside = merged.get(key)
        if isinstance(inside, dict) and isinstance(value, dict):
            merged[key] = _merged(inside, value)
        else:
            merged[key] = deepcopy(value)
    return merged
