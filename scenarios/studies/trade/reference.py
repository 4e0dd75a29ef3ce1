"""What a trade measures against: a run whose error is known to be small."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import xarray as xr

from scenarios.results.comparison import volume_error
from scenarios.running.progress import Progress, unwatched
from scenarios.running.run import run
from scenarios.scene.scenario import Scenario
from scenarios.studies.trade.schemes import with_inner_step, with_integrator

PARTS = 16
"""Equal steps of the coarser of the two reference runs in one communication step."""


def converged_reference(
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
    watch: Callable[[Progress], None] = progress or unwatched

    def first(at: Progress) -> None:
        watch(replace(at, duration=3 * at.duration))

    def second(at: Progress) -> None:
        watch(replace(at, time=at.duration + 2 * at.time, duration=3 * at.duration))

    coarse = run_finely(scenario, parts, first)
    fine = run_finely(scenario, 2 * parts, second)
    return fine, volume_error(coarse, fine)


def run_finely(
    scenario: Scenario, parts: int, progress: Callable[[Progress], None] | None = None
) -> xr.Dataset:
    """Run a scenario by ``sdirk2`` in so many equal steps a communication step."""
    stepped = with_inner_step(with_integrator(scenario.draft, "sdirk2"), 1 / parts)
    assert stepped is not None  # noqa: S101 - sdirk2 has inner steps
    return run(stepped.build(si=True), progress=progress)
