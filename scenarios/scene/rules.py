"""Rules between the fields of a scenario, which no type says."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, Final

from cosim.soft_body import body_ports
from scenarios.errors import ScenarioError
from scenarios.scene.schema import Mesh, Scene

_SOURCES: Final = ("lung", "file", "icosphere", "ball", "glass")

_OBSTACLE: Final = re.compile(r"[a-z][a-z0-9_]*")

_MOST_STEPS: Final = 10_000_000


def check_rules(scene: Scene, tables: Mapping[str, Any]) -> None:
    """Raise `ScenarioError` for the first rule that a scene breaks.

    Parameters
    ----------
    scene : Scene
        Whose fields fit, each by itself.
    tables : mapping
        That it was made of.
    """
    _check_drive(tables)
    _check_mesh(scene.mesh, "mesh")
    for obstacle in scene.obstacles:
        _check_name(obstacle.name)
        _check_mesh(obstacle.mesh, f"obstacles.{obstacle.name}.mesh")
    _check_steps(scene)


def _check_drive(tables: Mapping[str, Any]) -> None:
    if ("controller" in tables) == ("inputs" in tables):
        raise ScenarioError(
            "expected a table [controller], or a table [inputs] with the delta_p and n that are "
            f"held; got {'both' if 'inputs' in tables else 'neither'}"
        )


def _check_mesh(mesh: Mesh, path: str) -> None:
    given = [source for source in _SOURCES if getattr(mesh, source) is not None]
    if len(given) != 1:
        raise ScenarioError(
            f"{path}: expected exactly one of {', '.join(_SOURCES)}; "
            f"got {', '.join(given) or 'none'}"
        )
    if given[0] in ("icosphere", "ball") and mesh.volume is None:
        raise ScenarioError(f'{path}.volume is missing; a sphere needs text like "2.5 L"')


def _check_name(name: str) -> None:
    if not _OBSTACLE.fullmatch(name) or f"{name}_x" in body_ports():
        raise ScenarioError(
            f"obstacles.{name}: expected a name of small letters, digits and underscores that is "
            "none of the body's own variables: those of the obstacle begin with it"
        )


def _check_steps(scene: Scene) -> None:
    step, duration = scene.coupling.step, scene.run.cycles * scene.run.period
    if scene.steps > _MOST_STEPS:
        raise ScenarioError(
            f"coupling.step = {step:.3g} s makes {scene.steps:.3g} steps; "
            f"expected at most {_MOST_STEPS:.0e}: take a longer step or fewer cycles"
        )
    if not math.isclose(scene.steps * step, duration, rel_tol=1e-9):
        raise ScenarioError(
            f"coupling.step = {step:.6g} s does not divide the run of "
            f"{duration:.6g} s; choose a whole part of run.period"
        )
