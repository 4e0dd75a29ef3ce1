"""What is in a table is exported and documented; what is missing is said in words."""

from __future__ import annotations

from pathlib import Path

import pytest

import softbody_core
from softbody_core import CONSTRAINTS, FORCES, INTEGRATORS

DOCS = Path(__file__).parents[2] / "docs"

TABLES = {"forces": FORCES, "integrators": INTEGRATORS, "constraints": CONSTRAINTS}
PLACES = {
    "forces": ("scenario.md", "[forces.{}]"),
    "integrators": ("integrators.md", "`{}`"),
    "constraints": ("contact.md", "{}"),
}
"""Page where the entries of a table are described, and how they are written there."""

ENTRIES = [(part, name) for part, table in TABLES.items() for name in table]
each_entry = pytest.mark.parametrize(("part", "name"), ENTRIES, ids=lambda value: value)


@each_entry
def test_what_is_in_a_table_can_be_imported_from_the_top(part, name):
    kind = TABLES[part][name].__name__
    for package, file in (
        (f"softbody_core.{part}", f"softbody_core/{part}/__init__.py"),
        ("softbody_core", "softbody_core/__init__.pyi"),
    ):
        exported = __import__(package, fromlist=["__all__"]).__all__
        assert kind in exported, (
            f"{kind} is in a table and not exported by {file}: import it there, and add it to its "
            "__all__"
        )
    assert getattr(softbody_core, kind) is TABLES[part][name]


@each_entry
def test_what_is_in_a_table_is_documented(part, name):
    page, form = PLACES[part]
    written = form.format(name)
    assert written in (DOCS / page).read_text("utf-8"), (
        f"{name} is in softbody_core/{part}/__init__.py and not in docs/{page}: add a row with "
        f"{written} to its table"
    )
