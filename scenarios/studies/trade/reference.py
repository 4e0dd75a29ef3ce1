"""What a trade measures against: a run whose error is known to be small."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import xarray as xr

from scenarios.errors import ScenarioError
from scenarios.running.progress import Progress
from scenarios.running.run import run
from scenarios.scene.scenario import Scenario
from scenarios.studies.trade.schemes import with_inner_step, with_integrator

PARTS = 16
"""Equal steps of the coarser of the two reference runs in one communication step."""


def reference(
    scenario: Scenario,
    parts: int = PARTS,
    *,
    progress: Callable[[Progress], None] | None = None,
) -> tuple[xr.Dataset, float]:
    """Run a scenario so finely that its error in time is known to be small.

    The scheme is ``sdirk2`` in equal steps, its stages solved to a part of their error. It runs
    twice; the second run halves the step.

    Parameters
    ----------
    scenario : Scenario
        Its integrator is not used; all else is kept.
    parts : int
        Steps of the first run in one communication step; a power of two.
    progress : callable, optional
        As for `scenarios.run`; it sees both runs as one.

    Returns
    -------
    dataset : xarray.Dataset
        Of the finer run.
    error : float
        `volume_error` of the coarser run against it. Where second order is reached, the finer run's
        own error is a third of this; where steps are still too long for that, it can be more.

    Raises
    ------
    RunError
        If one of the runs ends early.
    """
    seen: Callable[[Progress], None] = progress if progress is not None else lambda _: None

    def first(at: Progress) -> None:
        seen(replace(at, duration=3 * at.duration))

    def second(at: Progress) -> None:
        seen(replace(at, time=at.duration + 2 * at.time, duration=3 * at.duration))

    coarse = run_finely(scenario, parts, first)
    fine = run_finely(scenario, 2 * parts, second)
    return fine, volume_error(coarse, fine)


def run_finely(
    scenario: Scenario, parts: int, progress: Callable[[Progress], None] | None = None
) -> xr.Dataset:
    """Run a scenario by ``sdirk2`` in so many equal steps a communication step."""
    stepped = with_inner_step(with_integrator(scenario, "sdirk2"), 1 / parts)
    assert stepped is not None  # noqa: S101 - sdirk2 has inner steps
    return run(stepped, progress=progress)


def volume_error(dataset: xr.Dataset, reference: xr.Dataset) -> float:
    """Largest deviation of the volume from a reference, as a share of the reference's range.

    Only times that both have are compared, so that nothing is interpolated. Two communication
    steps share all points of the longer one if the shorter one divides it.

    Parameters
    ----------
    dataset, reference : xarray.Dataset
        Of `scenarios.run`.

    Returns
    -------
    float
        max |V − V_ref| / (max V_ref − min V_ref), 1.

    Raises
    ------
    ScenarioError
        If they share no time but the start, or the reference's volume does not change.
    """
    ours, theirs = dataset["time"].to_numpy(), reference["time"].to_numpy()
    slack = 1e-9 * theirs[-1]  # i · h and 2i · h/2 differ by rounding
    match = np.minimum(np.searchsorted(theirs, ours - slack), len(theirs) - 1)
    common = np.abs(theirs[match] - ours) <= slack
    volume = reference["volume"].to_numpy()
    swing = float(np.ptp(volume))
    if common.sum() < 2 or swing == 0:
        raise ScenarioError(
            f"a run of {len(ours)} samples to {ours[-1]:g} s cannot be compared with one of "
            f"{len(theirs)} samples to {theirs[-1]:g} s, whose volume changes by {swing:g} L: "
            "expected times in common, and a volume that changes"
        )
    deviation = dataset["volume"].to_numpy()[common] - volume[match[common]]
    return float(np.abs(deviation).max() / swing)
