"""Strips of frames: how a body moves, and how bumpy it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from scenarios.results.analysis import whole_breaths
from scenarios.results.bumpiness import normal_deviation
from scenarios.results.rendering.camera import Array, Camera
from scenarios.results.rendering.render import Surface, linear, render
from scenarios.studies.paper.scenes import Datasets, weights_of

FRAMES: Final = (100, 1000, 2000, 3000, 4000, 6000)
"""Frames of Figures 1 to 6, time steps."""
_INHALING: Final = (0.0, 0.5, 1.0)
_EXHALING: Final = (0.1, 0.5, 1.0)
"""Moments of Figures 8 to 10, shares of a phase: its beginning, middle and end. A tenth, because
the first frame of an exhalation looks like the last one of the inhalation before it."""

_GLASS_VIEW: Final = (20.0, 8.0, 400)
_LUNG_VIEW: Final = (140.0, 0.0, 300)
"""Azimuth and elevation, °, and height, pixels. The lung shows its base and the sharp edge between
its two sides."""
_BALL: Final = (0.36, 0.09, 0.08)
"""Darker than tissue: it lies in the bright light that glass needs."""
_DPI: Final = 150
_TITLE: Final = 0.25
_LABEL: Final = 0.36
_BAR: Final = 0.8
"""Inches for the title, for the labels, and for a colour bar."""
_INKS: Final = 256
_BUMPS: Final = mpl.colormaps["YlOrBr"]
"""Its lightness falls all the way, so it reads in grey as well."""


@dataclass(frozen=True)
class Frame:
    """One picture of a strip: what it shows, and what is written under it."""

    surfaces: Sequence[Surface]
    label: str


def glass_strip(scene: str, title: str) -> Callable[[Datasets, Path], None]:
    """Return what draws Figures 1 to 6: a ball in a glass at the paper's frames."""

    def draw(datasets: Datasets, path: Path) -> None:
        dataset = datasets[scene]
        triangles = dataset["triangles"].to_numpy()
        glass = Surface(
            dataset["obstacle_points"].to_numpy(),
            dataset["obstacle_triangles"].to_numpy(),
            glass=True,
        )
        frames = [
            Frame((Surface(points, triangles, _BALL), glass), f"frame {number}\n{time:g} s")
            for number, (time, points) in _at_frames(dataset)
        ]
        focus = _bowl(glass.points, np.concatenate([frame.surfaces[0].points for frame in frames]))
        _save(_strip(frames, _GLASS_VIEW, _titled(dataset, title), focus=focus), path)

    return draw


def lung_strip(scene: str, title: str) -> Callable[[Datasets, Path], None]:
    """Return what draws Figures 8 to 10: the first breath, from rest."""

    def draw(datasets: Datasets, path: Path) -> None:
        dataset = datasets[scene]
        triangles = dataset["triangles"].to_numpy()
        phases, times = _phases(dataset)
        volume = dataset["volume"]
        frames = [
            Frame(
                (Surface(points, triangles),),
                f"{phase}, {time:.1f} s\n{float(volume.sel(time=time, method='nearest')):.2f} L",
            )
            for phase, (time, points) in zip(phases, _snapshots(dataset, times), strict=True)
        ]
        _save(_strip(frames, _LUNG_VIEW, _titled(dataset, title), outline=True), path)

    return draw


def bumpiness_strip(scenes: Sequence[str], title: str) -> Callable[[Datasets, Path], None]:
    """Return what draws Figure 12: surfaces at the end of a breath, coloured by bumpiness."""

    def draw(datasets: Datasets, path: Path) -> None:
        runs = [datasets[scene] for scene in scenes]
        shapes = [
            (dataset["position"].to_numpy()[-1], dataset["triangles"].to_numpy())
            for dataset in runs
        ]
        bumps = [np.abs(normal_deviation(*shape)) for shape in shapes]
        scale = Normalize(0.0, float(np.quantile(np.concatenate(bumps), 0.99)), clip=True)
        frames = [
            Frame(
                (Surface(points, triangles, linear(_BUMPS(scale(bump))[:, :3])),),
                f"β = {weights_of(dataset).beta:g}",
            )
            for dataset, (points, triangles), bump in zip(runs, shapes, bumps, strict=True)
        ]
        figure = _strip(frames, _LUNG_VIEW, title, right=_BAR)
        wide = figure.get_figwidth()
        bar = figure.add_axes((1 - _BAR / wide, 0.2, 0.12 / wide, 0.6))
        figure.colorbar(ScalarMappable(scale, _BUMPS), cax=bar, extend="max")
        bar.set_ylabel("distance from the smoothed\nsurface (mean edges)", fontsize=7)
        bar.tick_params(labelsize=7)
        _save(figure, path)

    return draw


def _titled(dataset: xr.Dataset, title: str) -> str:
    w = weights_of(dataset)
    return f"{title}: α = {w.alpha:g}, β = {w.beta:g}, γ = {w.gamma:g}, δ = {w.delta:g}"


def _bowl(glass: Array, ball: Array) -> Array:
    """Points that a picture of a ball in a glass has to hold: not the stem below both."""
    lowest = ball[:, 2].min()
    above = 0.03 * np.ptp(glass[:, 2])
    return np.concatenate([ball, glass[glass[:, 2] > lowest - above]])


def _at_frames(dataset: xr.Dataset) -> list[tuple[int, tuple[float, Array]]]:
    """Those of the paper's frames that the run has, with time and positions; a frame is a step."""
    times = dataset["time"].to_numpy()
    numbers = [number for number in FRAMES if number < len(times)]
    return list(zip(numbers, _snapshots(dataset, times[numbers]), strict=True))


def _phases(dataset: xr.Dataset) -> tuple[list[str], list[float]]:
    """Names and times of the moments of the first breath."""
    first = whole_breaths(dataset).isel(breath=0)
    half = float(first["duration"]) / 2
    names = ["inhaling"] * len(_INHALING) + ["exhaling"] * len(_EXHALING)
    times = [half * share for share in _INHALING] + [half * (1 + share) for share in _EXHALING]
    return names, times


def _snapshots(dataset: xr.Dataset, times: Iterable[float]) -> list[tuple[float, Array]]:
    """Time and positions of the snapshots nearest to `times`."""
    times_of_snapshots = dataset["snapshot_time"].to_numpy()
    nearest = [int(np.argmin(np.abs(times_of_snapshots - time))) for time in times]
    return [(float(times_of_snapshots[i]), dataset["position"].to_numpy()[i]) for i in nearest]


def _strip(
    frames: Sequence[Frame],
    view: tuple[float, float, int],
    title: str,
    *,
    focus: Array | None = None,
    outline: bool = False,
    right: float = 0.0,
) -> Figure:
    """Frames side by side, all from one camera, pixel by pixel.

    `focus` is what a frame has to hold, by default all of it; `outline` draws that of the first one
    in the others; `right` leaves so many inches free there.
    """
    if focus is None:
        focus = np.concatenate([s.points for frame in frames for s in frame.surfaces])
    camera = Camera.around(focus, *view)
    pictures = [render(frame.surfaces, camera) for frame in frames]
    wide, high = (pixels / _DPI for pixels in camera.pixels)
    size = np.array([wide * len(frames) + right, high + _LABEL + _TITLE])
    figure = Figure(figsize=tuple(size), dpi=_DPI)
    figure.suptitle(title, fontsize=8, y=1 - 0.2 * _TITLE / size[1], va="top")
    for i, (picture, frame) in enumerate(zip(pictures, frames, strict=True)):
        axes = figure.add_axes((i * wide / size[0], _LABEL / size[1], *([wide, high] / size)))
        axes.imshow(picture[..., :3], interpolation="none")
        if outline and i > 0:
            axes.contour(pictures[0][..., 3], [0.5], colors="0.25", linewidths=0.7, linestyles="--")
        axes.set_xlabel(frame.label, fontsize=7)
        axes.set(xticks=[], yticks=[])
        axes.spines[:].set_visible(False)
    return figure


def _save(figure: Figure, path: Path) -> None:
    """Write a picture in few colours: a quarter of the size, and hardly a difference to the eye."""
    from PIL import Image  # with the renderer, an extra

    whole = BytesIO()
    figure.savefig(whole, dpi=_DPI, format="png")
    few = Image.open(whole).convert("RGB").quantize(_INKS)
    few.save(path, format="PNG", optimize=True)
