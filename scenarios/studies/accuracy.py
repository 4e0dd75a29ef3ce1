"""Pick the cheapest way to run a scenario to a given accuracy, by trying ways on its first breath.

Costs are counts and not times, so the same scenario gets the same pick on every machine.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import xarray as xr

from scenarios.errors import Interrupted, ScenarioError
from scenarios.results.comparison import volume_error
from scenarios.running.progress import Progress, StudyProgress, Watch, unwatched
from scenarios.running.run import run
from scenarios.scene.scenario import Scenario
from softbody_core import Counters, SimulationError

Integrator = Mapping[str, Any]

_SOLVE: Final = 0.5
"""Cost of a linear solution in force evaluations: 0.2 to 0.7 on the lungs and spheres that ship."""
_MARGIN: Final = 1.5
"""Asked accuracy over the estimated error of what is picked."""
_FINER: Final = (0.1, 0.01)
"""Tolerances over the accuracy of the run that the others are measured against; the second where
the first is not good enough."""
_LEFT: Final = 0.7
"""Error of that run over its distance from the one before it; 0.27 at best."""
_FINEST: Final = 1e-6
"""Accuracy beyond which rounding and the sampling of controllers leave nothing to measure."""


@dataclass(frozen=True)
class Pick:
    """What was picked, and why.

    Attributes
    ----------
    scenario : Scenario
        With the integrator that was picked.
    integrator : mapping
        Its table, as in a scenario.
    error : float
        Estimated largest deviation of the volume over its range, 1.
    tried : tuple of (mapping, float, float)
        Each integrator that was tried, its estimated error and its cost in force evaluations; NaN
        for one that failed or was dearer than a better one.
    """

    scenario: Scenario
    integrator: Integrator
    error: float
    tried: tuple[tuple[Integrator, float, float], ...]

    @property
    def name(self) -> str:
        """The integrator in words."""
        options = (
            f"{key} = {value:g}" for key, value in self.integrator.items() if key != "method"
        )
        return ", ".join([self.integrator["method"], *options])


class _Dearer(SimulationError):
    """A run costs more than another that is good enough."""


def families(accuracy: float) -> list[list[Integrator]]:
    """Ways to run, each family from coarse to fine."""
    return [
        [{"method": "quasi-static", "spacing": spacing} for spacing in (0.1, 0.05, 0.025)],
        [{"method": "sdirk2", "tolerance": part * accuracy} for part in (10.0, 3.0, 1.0, 0.3)],
        [{"method": "symplectic-euler"}, {"method": "velocity-verlet"}],
    ]


def pick(
    scenario: Scenario,
    accuracy: float,
    *,
    progress: Watch | None = None,
) -> Pick:
    """Pick the cheapest integrator that holds an accuracy.

    Each candidate runs the scenario's first breath and is measured against ``sdirk2`` at a tenth or
    a hundredth of the accuracy. The estimate of its error is what is measured, plus what is left in
    that run.

    Parameters
    ----------
    scenario : Scenario
        Its own integrator is not used.
    accuracy : float
        Largest deviation of the volume over its range that is allowed, 1.
    progress : callable, optional
        Called at each communication point of each run.

    Returns
    -------
    Pick
        If no candidate holds the accuracy, the run that they were measured against. Its error may
        still be larger than what was asked.

    Raises
    ------
    ScenarioError
        If the accuracy is out of range.
    RunError
        If the run that the others are measured against fails.
    """
    if not _FINEST <= accuracy <= 0.5:
        raise ScenarioError(f"accuracy = {accuracy:g}: expected {_FINEST:g} to 0.5")
    watch = progress or unwatched
    breath = scenario.changed({"run.cycles": 1})
    finer: Integrator = {"method": "sdirk2", "tolerance": accuracy}
    against, left = _pilot(breath, finer, watch), float("inf")
    for part in _FINER:
        if _MARGIN * left <= accuracy:
            break
        finer = {"method": "sdirk2", "tolerance": part * accuracy}
        coarser, against = against, _pilot(breath, finer, watch)
        left = _LEFT * volume_error(coarser, against)
    best, lowest = finer, _cost(against)
    error = left
    tried: list[tuple[Integrator, float, float]] = [(finer, left, lowest)]
    ways = families(accuracy) if _MARGIN * left <= accuracy else []
    for family in ways:
        for candidate in family:  # from coarse to fine, until one is good enough, or too dear
            try:
                dataset = _pilot(breath, candidate, watch, lowest)
            except Interrupted:
                raise
            except SimulationError:
                tried.append((candidate, float("nan"), float("nan")))
                break
            estimate, cost = volume_error(dataset, against) + left, _cost(dataset)
            tried.append((candidate, estimate, cost))
            if _MARGIN * estimate <= accuracy:
                if cost < lowest:
                    best, lowest, error = candidate, cost, estimate
                break
    return Pick(scenario.changed({"integrator": dict(best)}), best, error, tuple(tried))


def _pilot(
    scenario: Scenario,
    integrator: Integrator,
    watch: Watch,
    most: float = float("inf"),
) -> xr.Dataset:
    """Run, but no further than a cost of `most`."""

    def show(at: Progress) -> None:
        watch(StudyProgress(f"trying {integrator['method']}", at.time / at.duration, 1))
        if _price(at.counters) > most:
            raise _Dearer("another way is good enough, and costs less")

    return run(scenario.changed({"integrator": dict(integrator)}), progress=show)


def _price(counters: Counters) -> float:
    return counters.force_evaluations + _SOLVE * counters.linear_solves


def _cost(dataset: xr.Dataset) -> float:
    return float(dataset.attrs["force_evaluations"] + _SOLVE * dataset.attrs["linear_solves"])
