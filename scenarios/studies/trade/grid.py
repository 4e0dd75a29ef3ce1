"""Run a grid of settings against one reference."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np
import xarray as xr

from scenarios.errors import Interrupted, RunError, ScenarioError
from scenarios.running.progress import Progress, StudyProgress, Watch, unwatched
from scenarios.running.run import COMPLETED, run
from scenarios.scene.scenario import Scenario
from scenarios.studies.trade.axes import Value, axis_values, finest, named, put_all
from scenarios.studies.trade.order import convergence_order
from scenarios.studies.trade.reference import PARTS, reference, run_finely, volume_error
from scenarios.studies.trade.result import describe_reference, empty, record
from softbody_core import SoftBodyError

MEANS_NOTHING: Final = "this axis means nothing to this scheme"
STOPPED: Final = "stopped"


class _TooSlow(SoftBodyError):
    """A cell took longer than it may."""


def trade(
    scenario: Scenario,
    axes: Sequence[str] | Mapping[str, Sequence[Value] | None] = ("integrator", "dt"),
    cycles: int = 1,
    *,
    limit: float = 60.0,
    progress: Watch | None = None,
) -> xr.Dataset:
    """Run a grid of settings, and measure the error and the cost of each.

    Parameters
    ----------
    scenario : Scenario
        What to run. What is no axis stays as it is there.
    axes : sequence of str, or mapping of str to values
        Names from `AXES`; a mapping gives an axis its own values, or None for its default ones.
    cycles : int
        Breaths in each run.
    limit : float
        Computing time after which a cell is stopped, s. Shorter inner steps of the same setting
        are then left out.
    progress : callable, optional
        Called at each communication point of each run.

    Returns
    -------
    xarray.Dataset
        See ``docs/trade.md``. A cell without a result holds NaN, and says why in ``status``.

    Raises
    ------
    ScenarioError, FmuError, WiringError, MeshError
        If an axis or a value is not as expected, or the scenario cannot start.
    RunError
        If the reference failed, or someone interrupted; its ``dataset`` holds the cells until then.
    """
    if not limit > 0:
        raise ScenarioError(f"limit = {limit:g} s: expected a positive time")
    values = axis_values(scenario, axes)
    scenario = scenario.changed({"run.cycles": cycles})
    grid = _Grid(scenario, values, limit, progress or unwatched)
    try:
        grid.run_reference()
        grid.run_cells()
    except (Interrupted, KeyboardInterrupt) as error:
        grid.result.attrs["status"] = "interrupted"
        raise Interrupted("interrupted", grid.result) from error
    except RunError as error:
        grid.result.attrs["status"] = f"failed: the reference: {error}"
        raise RunError(f"the reference: {error}", grid.result) from error
    grid.result.attrs["status"] = COMPLETED
    return grid.result


class _Grid:
    """Cells, and the dataset that they fill."""

    def __init__(
        self,
        scenario: Scenario,
        values: Mapping[str, tuple[Value, ...]],
        limit: float,
        watch: Watch,
    ) -> None:
        self.result = empty(scenario, values)
        self._limit, self._watch = limit, watch
        names = list(values)
        shape = [len(own) for own in values.values()]
        self._settings = {
            index: {name: values[name][i] for name, i in zip(names, index, strict=True)}
            for index in np.ndindex(*shape)
        }
        # Whatever a scenario refuses, it refuses here, before anything runs.
        self._cells = {index: put_all(scenario, said) for index, said in self._settings.items()}
        self._finest = put_all(scenario, finest(values)) or scenario
        self._sizes = [int(points) for points in values.get("points", ())]
        self._total = 1 + len(self._sizes[:-1]) + len(self._cells)
        self._done = 0

    def run_reference(self) -> None:
        """Run what the cells are measured against; with an axis of points, on each mesh."""
        self._reference, error = reference(self._finest, PARTS, progress=self._show("reference"))
        self._done += 1
        describe_reference(self.result, self._reference, error, 2 * PARTS)
        curves = [self._reference]
        for points in reversed(self._sizes[:-1]):
            coarser = put_all(self._finest, {"points": points}) or self._finest
            curves.insert(
                0, run_finely(coarser, 2 * PARTS, self._show(f"reference, points {points}"))
            )
            self._done += 1
        changes = [volume_error(coarse, fine) for coarse, fine in pairwise(curves)]
        if changes:
            self.result["points_change"][:-1] = changes
            self.result.attrs["points_order"] = convergence_order(self._sizes, changes)

    def run_cells(self) -> None:
        """Run each cell. One that fails says so, and the next one runs."""
        status = self.result["status"].to_numpy()
        for index, cell in self._cells.items():
            name = named(self._settings[index])
            if cell is None:
                status[index] = MEANS_NOTHING
            elif self._was_too_slow(index):
                status[index] = f"{STOPPED}: a longer step took too long"
            else:
                try:
                    dataset = run(cell, progress=self._show(name, self._limit))
                    record(self.result, index, dataset, self._reference)
                except Interrupted:
                    raise
                except SoftBodyError as error:
                    slow = isinstance(error.__cause__, _TooSlow)
                    status[index] = f"{STOPPED}: {error}" if slow else f"failed: {error}"
            self._done += 1
            self._watch(StudyProgress(name, self._done, self._total))

    def _was_too_slow(self, index: tuple[int, ...]) -> bool:
        """Tell whether the same setting with the next longer inner step was stopped."""
        status = self.result["status"]
        if "dt" not in status.dims:
            return False
        axis = status.dims.index("dt")
        longer = (*index[:axis], index[axis] - 1, *index[axis + 1 :])
        return index[axis] > 0 and str(status.to_numpy()[longer]).startswith(STOPPED)

    def _show(self, name: str, limit: float | None = None) -> Callable[[Progress], None]:
        now = StudyProgress(name, self._done, self._total)

        def show(at: Progress) -> None:
            self._watch(replace(now, done=now.done + at.time / at.duration))
            if limit is not None and at.wall_time > limit:
                raise _TooSlow(f"it took more than {limit:g} s")

        return show
