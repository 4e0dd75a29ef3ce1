"""Tables 1 to 3: the paper's parameters, and what was measured with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

import xarray as xr

from scenarios.results.analysis import whole_breaths
from scenarios.studies.paper.glass import (
    frames_per_second,
    kept_volume,
    nearest_wall,
    real_time_factor,
    roughness,
)
from scenarios.studies.paper.lungs import bumpiness_after_breaths, kept_shares
from scenarios.studies.paper.measurement import listed
from scenarios.studies.paper.scenes import ALPHA, BETA, GLASS, Datasets, weights_of

Column = Callable[[xr.Dataset], str]


def _residual(dataset: xr.Dataset) -> str:
    return listed(1000 * whole_breaths(dataset)["residual_volume"].to_numpy(), ".0f")


EXPERIMENTS: Final[dict[str, tuple[Mapping[str, str], Mapping[str, Column]]]] = {
    "table-1": (
        GLASS,
        {
            "FPS": lambda d: f"{frames_per_second(d):.0f}",
            "× real time": lambda d: f"{real_time_factor(d):.2f}",
            "roughness (mean edges)": lambda d: f"{roughness(d):.4f}",
            "volume over that at rest": lambda d: f"{kept_volume(d):.2f}",
            "nearest to a wall (mm)": lambda d: f"{1000 * nearest_wall(d):.3f}",
        },
    ),
    "table-2": (
        ALPHA,
        {
            "above rest after each breath (mL)": _residual,
            "of what was inhaled": lambda d: f"{kept_shares(d)[-1]:.1%}",
        },
    ),
    "table-3": (
        BETA,
        {
            "bumpiness after each breath (mean edges)": lambda d: listed(
                bumpiness_after_breaths(d), ".4f"
            ),
            "above rest after each breath (mL)": _residual,
        },
    ),
}
"""Scene of each experiment of a table, and what is measured of it."""


def write_table(name: str) -> Callable[[Datasets, Path], None]:
    """Return what writes a table as Markdown."""
    scenes, columns = EXPERIMENTS[name]

    def write(datasets: Datasets, path: Path) -> None:
        headings = ["experiment", "scene", "α", "β", "γ", "δ", *columns]
        lines = [f"| {' | '.join(headings)} |", "|---" * len(headings) + "|"]
        for letter, scene in scenes.items():
            w = weights_of(datasets[scene])
            weights = (f"{value:g}" for value in (w.alpha, w.beta, w.gamma, w.delta))
            measured = (column(datasets[scene]) for column in columns.values())
            lines.append(f"| {' | '.join([letter, scene, *weights, *measured])} |")
        path.write_text("\n".join([*lines, ""]), encoding="utf-8")

    return write
