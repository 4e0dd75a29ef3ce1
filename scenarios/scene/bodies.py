"""The tables ``[bodies.x]``: several bodies, each with its own changes to what they share."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from scenarios.errors import ScenarioError
from scenarios.scene.tables import merge, refuse_unknown, table

_SPECIAL: Final = ("mesh", "body", "forces", "constraints", "integrator")
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
    changes_of = table(data["bodies"], "bodies")
    if len(changes_of) < 2:
        raise ScenarioError(
            f"bodies: expected two tables or more, like [bodies.left] and [bodies.right]; got "
            f"{', '.join(changes_of) or 'none'}. One body needs no table of its own"
        )
    if "obstacles" in data:
        raise ScenarioError("obstacles: a scenario with several bodies takes none")
    shared = {key: value for key, value in data.items() if key != "bodies"}
    tables = {}
    for name, changes in changes_of.items():
        if not _NAME.fullmatch(name) or name in _TAKEN:
            raise ScenarioError(
                f"bodies.{name}: expected a name of small letters and digits, other than "
                f"{' and '.join(_TAKEN)}: the variables of the dataset begin with it"
            )
        refuse_unknown(table(changes, f"bodies.{name}"), list(_SPECIAL), f"bodies.{name}")
        tables[name] = merge(shared, changes)
    return tables
