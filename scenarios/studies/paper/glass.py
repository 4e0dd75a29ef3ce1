"""What section 4 of the paper says: the ball in the wine glass."""

from __future__ import annotations

from typing import Final

import numpy as np
import trimesh
import xarray as xr

from scenarios.errors import ScenarioError
from scenarios.results.bumpiness import bumpiness
from scenarios.studies.paper.measurement import Measurement, Statement, increasing, listed
from scenarios.studies.paper.scenes import GLASS, Datasets

_LANDED: Final = 1000
"""Frame from which roughness is looked at; before it the ball falls."""
_BEYOND: Final = 1e-3
"""Distance beyond a wall that is allowed, m."""
_BOWL_RADIUS: Final = 0.0405
"""Largest radius of the bowl, in the profile of `softbody_core.wine_glass`, m."""
_BOWL_FLOOR: Final = 0.095
_BOWL_RIM: Final = 0.205
"""Heights of the lowest point within the bowl and of its rim above the foot, in that profile, m."""
_STILL: Final = 2e-3
"""Speed below which each point of a ball at rest is, between the last two snapshots, m/s. The paper
gives none: at this one a point takes 20 s to cross the bowl."""
_PAPER_FPS: Final = 20.0


def roughness(dataset: xr.Dataset) -> float:
    """Mean bumpiness after landing, less that at rest, in mean edges.

    Raises
    ------
    ScenarioError
        If the run ends before.
    """
    frames = dataset.sizes["time"] - 1
    if frames < _LANDED:
        raise ScenarioError(f"the run has {frames} frames; expected {_LANDED} or more")
    triangles = dataset["triangles"].to_numpy()
    shapes = dataset["position"].to_numpy()
    landed = dataset["snapshot_time"].to_numpy() >= float(dataset["time"][_LANDED]) - 1e-9
    return float(np.mean([bumpiness(x, triangles, shapes[0]) for x in shapes[landed]]))


def kept_volume(dataset: xr.Dataset) -> float:
    """Volume at the end over that at rest."""
    return float(dataset["volume"][-1] / dataset["volume"][0])


def nearest_wall(dataset: xr.Dataset) -> float:
    """Smallest distance of any point from a wall, ever; below zero beyond it, m."""
    return float(dataset["clearance"].min())


def frames_per_second(dataset: xr.Dataset) -> float:
    """Time steps in a second of computing; a frame of the paper is one time step."""
    return (dataset.sizes["time"] - 1) / float(dataset.attrs["wall_time"])


def real_time_factor(dataset: xr.Dataset) -> float:
    """Simulated over computing time."""
    return float(dataset["time"][-1]) / float(dataset.attrs["wall_time"])


def rests_inside(dataset: xr.Dataset) -> bool:
    """Whether each point of the last snapshot lies in the glass's bowl and hardly moves.

    Raises
    ------
    ScenarioError
        If there are no two snapshots.
    """
    if dataset.sizes["snapshot"] < 2:
        raise ScenarioError("the run has one snapshot; expected 2 or more: give it more time")
    before, last = dataset["position"].to_numpy()[-2:]
    wall = dataset["obstacle_points"].to_numpy()
    foot = [*wall[:, :2].mean(axis=0), wall[:, 2].min()]  # where the glass's axis meets the table
    x, y, height = (last - foot).T
    inside = (np.hypot(x, y) < _BOWL_RADIUS) & (height >= _BOWL_FLOOR) & (height <= _BOWL_RIM)
    interval = float(dataset["snapshot_time"].diff("snapshot")[-1])
    speed = np.linalg.norm(last - before, axis=1) / interval
    return bool(inside.all() and (speed < _STILL).all())


def _each(datasets: Datasets, letters: str) -> dict[str, xr.Dataset]:
    return {letter: datasets[GLASS[letter]] for letter in letters}


def _counts(datasets: Datasets) -> Measurement:
    dataset = datasets[GLASS["A"]]
    mesh = trimesh.Trimesh(dataset["position"][0], dataset["triangles"], process=False)
    counts = len(mesh.vertices), len(mesh.faces), len(mesh.edges_unique)
    return Measurement(
        "{:,} points, {:,} faces, {:,} springs".format(*counts), counts == (1986, 3968, 5952)
    )


def _finite(datasets: Datasets) -> Measurement:
    runs = _each(datasets, "ABCDEF")
    finite = [letter for letter, d in runs.items() if np.isfinite(d["position"]).all()]
    frames = min(d.sizes["time"] for d in runs.values()) - 1
    return Measurement(
        f"{', '.join(finite)} stay finite for {frames} frames", len(finite) == len(runs)
    )


def _rests(datasets: Datasets) -> Measurement:
    runs = _each(datasets, "ABCDE")
    rests = [letter for letter, dataset in runs.items() if rests_inside(dataset)]
    return Measurement(f"{', '.join(rests) or 'none'} rest in the bowl", len(rests) == len(runs))


def _walls(datasets: Datasets) -> Measurement:
    nearest = [nearest_wall(dataset) for dataset in _each(datasets, "ABCDEF").values()]
    return Measurement(
        f"no point ever nearer to a wall than {listed((1000 * d for d in nearest), '.3f')} mm "
        "(A to F; below 0 is beyond it)",
        min(nearest) >= -_BEYOND,
    )


def _rougher(datasets: Datasets) -> Measurement:
    values = [roughness(dataset) for dataset in _each(datasets, "ABC").values()]
    return Measurement(
        f"A, B, C: {listed(values, '.4f')} mean edges above rest", increasing(values)
    )


def _bubbles(datasets: Datasets) -> Measurement:
    volumes = {letter: kept_volume(d) for letter, d in _each(datasets, "ABCDE").items()}
    text = ", ".join(f"{letter} {share:.2f}" for letter, share in volumes.items())
    return Measurement(
        f"volume over that at rest: {text}",
        min(volumes[k] for k in "DE") > max(volumes[k] for k in "ABC"),
    )


def _no_effect(datasets: Datasets) -> Measurement:
    rough = {letter: roughness(d) for letter, d in _each(datasets, "ACDE").items()}
    strong, weak = abs(rough["E"] - rough["D"]), abs(rough["C"] - rough["A"])
    return Measurement(
        f"β = 2 changes the roughness by {strong:.4f} from D to E, by {weak:.4f} from A to C: "
        f"{strong / weak:.0%}",
        strong < weak / 4,
    )


def _cloth(datasets: Datasets) -> Measurement:
    share = kept_volume(datasets[GLASS["F"]])
    return Measurement(f"{1 - share:.0%} of the volume is lost", share < 0.5)


def _fps(datasets: Datasets) -> Measurement:
    runs = _each(datasets, "ABCDEF").values()
    fps = [frames_per_second(dataset) for dataset in runs]
    speed = [real_time_factor(dataset) for dataset in runs]
    return Measurement(
        f"{listed(fps, '.0f')} frames a second (A to F): {min(fps) / _PAPER_FPS:.1f} to "
        f"{max(fps) / _PAPER_FPS:.1f} times 20, and {min(speed):.2f} to {max(speed):.2f} times "
        "real time",
        min(fps) > _PAPER_FPS,
    )


_ALL: Final = tuple(GLASS.values())
_A_TO_E: Final = _ALL[:5]

BALL: Final = (
    Statement(
        "section 4",
        "“1,986 surface points, 3,968 faces, and 5,952 springs”",
        (GLASS["A"],),
        _counts,
    ),
    Statement("section 4, Table 1", "all six sets of parameters run", _ALL, _finite),
    Statement(
        "section 4",
        "“a soft body is dropped into a rigid-body wine glass”: A to E come to rest in its bowl",
        _A_TO_E,
        _rests,
    ),
    Statement("section 4", "the glass is rigid: no point passes a wall", _ALL, _walls),
    Statement(
        "section 4, Figures 1 to 3",
        "A “smooth surface”, B “undulating surface waves”, C “more”",
        tuple(GLASS[letter] for letter in "ABC"),
        _rougher,
    ),
    Statement(
        "section 4, Figures 4 and 5",
        "D and E “behave like bubbles or rubber balls”: they keep more volume than A to C",
        _A_TO_E,
        _bubbles,
    ),
    Statement(
        "section 4, Figure 5",
        "under high pressure “the fluid force parameter does not affect visual result”",
        tuple(GLASS[letter] for letter in "ACDE"),
        _no_effect,
    ),
    Statement(
        "section 4, Figure 6",
        "F is “without volume much like fabric or cloth”",
        (GLASS["F"],),
        _cloth,
    ),
    Statement("section 4, Table 1", "more than 20 frames a second", _ALL, _fps),
)
"""Statements on the ball."""
