"""What can be asked for: the paper's figures and tables, and the scenes that each needs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cosim.errors import nearest
from scenarios.errors import ScenarioError
from scenarios.studies.paper.curves import pressure_volume, volumes
from scenarios.studies.paper.scenes import ALPHA, BETA, GLASS, THERMOSTAT, Datasets
from scenarios.studies.paper.strips import bumpiness_strip, glass_strip, lung_strip
from scenarios.studies.paper.tables import EXPERIMENTS, write_table

ALL: Final = "all"


@dataclass(frozen=True)
class Target:
    """A figure or a table.

    Attributes
    ----------
    scenes : tuple of str
        Whose datasets it needs.
    write : callable
        Writes it to a path, from those datasets.
    suffix : str
        Of its file.
    rendered : bool
        Whether it shows surfaces, which takes a renderer.
    """

    scenes: tuple[str, ...]
    write: Callable[[Datasets, Path], None]
    suffix: str = ".png"
    rendered: bool = False


def _ball(number: int, letter: str) -> Target:
    scene = GLASS[letter]
    title = f"Figure {number}, experiment {letter} of Table 1"
    return Target((scene,), glass_strip(scene, title), rendered=True)


def _lung(number: int, letter: str) -> Target:
    scene = ALPHA[letter]
    title = f"Figure {number}, experiment {letter} of Table 2"
    return Target((scene,), lung_strip(scene, title), rendered=True)


TARGETS: Final[dict[str, Target]] = {
    **{f"figure-{i}": _ball(i, letter) for i, letter in enumerate(GLASS, start=1)},
    "figure-7": Target((ALPHA["C"], THERMOSTAT), pressure_volume),
    **{f"figure-{i}": _lung(i, letter) for i, letter in enumerate(ALPHA, start=8)},
    "figure-11": Target(tuple(ALPHA.values()), volumes),
    "figure-12": Target(
        tuple(BETA.values()),
        bumpiness_strip(tuple(BETA.values()), "Figure 12: bumpiness at the end of the last breath"),
        rendered=True,
    ),
    **{
        name: Target(tuple(scenes.values()), write_table(name), suffix=".md")
        for name, (scenes, _) in EXPERIMENTS.items()
    },
}


def choose_targets(names: Iterable[str]) -> dict[str, Target]:
    """Targets by name, in the paper's order; ``all`` stands for every one.

    Raises
    ------
    ScenarioError
        If a name is unknown.
    """
    wanted = set(names)
    for name in wanted - {ALL, *TARGETS}:
        raise ScenarioError(
            f"no figure or table is named {name!r}; {nearest(name, [*TARGETS, ALL])}"
        )
    return {name: target for name, target in TARGETS.items() if name in wanted or ALL in wanted}
