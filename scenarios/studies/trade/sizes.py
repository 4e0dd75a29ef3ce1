"""Meshes that come in several sizes."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Final

from scenarios.errors import ScenarioError
from scenarios.scene.scenario import Draft
from scenarios.scene.schema import Mesh
from scenarios.scene.shipped import MESHES

_ICOSPHERES: Final = {10 * 4**level + 2: level for level in range(7)}
"""Subdivisions of an icosphere by its number of points."""

_SPHERE_SIZES: Final = [162, 642, 2562]


def sizes(draft: Draft) -> Sequence[int]:
    """Numbers of points that a scenario's mesh comes in.

    Raises
    ------
    ScenarioError
        If it comes in one size only.
    """
    mesh = _mesh(draft)
    return _SPHERE_SIZES if mesh.lung is None and mesh.file is None else sorted(_lungs(mesh))


def with_points(draft: Draft, points: int) -> Draft:
    """Return the scenario with its mesh in another size.

    Raises
    ------
    ScenarioError
        If the mesh does not come in that size.
    """
    mesh = _mesh(draft)
    if mesh.ball is not None:
        return draft.changed({"mesh.ball": points})
    key = "icosphere" if mesh.icosphere is not None else "lung"
    known: Mapping[int, int | str] = _ICOSPHERES if key == "icosphere" else _lungs(mesh)
    if points not in known:
        raise ScenarioError(
            f"points = {points}: expected one of {', '.join(map(str, sorted(known)))}"
        )
    return draft.changed({f"mesh.{key}": known[points]})


def _mesh(draft: Draft) -> Mesh:
    """The mesh of the one body."""
    bodies = draft.tables.get("bodies")
    if bodies is not None:
        raise ScenarioError(
            f"axis points varies one mesh, and this scenario has {len(bodies)} bodies: "
            f"{', '.join(bodies)}"
        )
    mesh: Mesh = draft.read("mesh")
    return mesh


def _lungs(mesh: Mesh) -> dict[int, str]:
    """Names of the surfaces that ship in the shape of the mesh, by their number of points."""
    family = re.fullmatch(r"(.+)-\d+", mesh.lung or "")
    if family is None:
        raise ScenarioError(
            "axis points needs a mesh that comes in several sizes: icosphere, ball, or a lung that "
            f"ships; this scenario's mesh.file is {mesh.file}"
        )
    matches = (re.fullmatch(rf"{family[1]}-(\d+)", path.stem) for path in MESHES.glob("*.ply"))
    return {int(match[1]): match[0] for match in matches if match}
