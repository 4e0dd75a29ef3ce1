"""Run a grid of settings against one reference."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np
import xarray as xr

from scenarios.errors import Interrupted, RunError, ScenarioError
from scenarios.results.comparison import volume_error
from scenarios.running.progress import Progress, StudyProgress, Watch, unwatched
from scenarios.running.run import COMPLETED, run
from scenarios.scene.scenario import Scenario
from scenarios.studies.trade.axes import AXES, Value
from scenarios.studies.trade.order import convergence_order
from scenarios.studies.trade.reference import PARTS, converged_reference, run_finely
from scenarios.studies.trade.result import describe_reference, empty, is_mesh, record
from scenarios.studies.trade.settings import axis_values, finest, in_words, put_all
from softbody_core import SimulationError

MEANS_NOTHING: Final = "this axis means nothing to this scheme"
STOPPED: Final = "stopped"


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
        self._settings = {
            index: {name: along[i] for (name, along), i in zip(values.items(), index, strict=True)}
            for index in np.ndindex(*map(len, values.values()))
        }
        # Whatever a scenario refuses, it refuses here, before anything runs.
        self._cells = {
            index: put_all(scenario, setting) for index, setting in self._settings.items()
        }
        self._finest = put_all(scenario, finest(values)) or scenario
        self._meshes = {name: values[name] for name in values if is_mesh(name)}
        coarser = sum(len(sizes) - 1 for sizes in self._meshes.values())
        self._total = 1 + coarser + len(self._cells)
        self._done = 0

    def run_reference(self) -> None:
        """Run what the cells are measured against; with an axis of meshes, on each of them."""
        progress = self._progress_of("reference")
        self._reference, error = converged_reference(self._finest, PARTS, progress=progress)
        self._done += 1
        describe_reference(self.result, self._reference, error, 2 * PARTS)
        for name, sizes in self._meshes.items():
            self._run_meshes(name, sizes)

    def _run_meshes(self, name: str, sizes: Sequence[Value]) -> None:
        """Run the reference on coarser meshes, for the order of convergence."""
        curves = [self._reference]
        for size in reversed(sizes[:-1]):
            coarser = put_all(self._finest, {name: size}) or self._finest
            progress = self._progress_of(f"reference, {name} {size}")
            curves.insert(0, run_finely(coarser, 2 * PARTS, progress))
            self._done += 1
        changes = [volume_error(coarse, fine) for coarse, fine in pairwise(curves)]
        width = AXES[name].width
        if changes and width is not None:
            self.result[f"{name}_change"][:-1] = changes
            widths = width(np.asarray(sizes, float))
            self.result.attrs[f"{name}_order"] = convergence_order(widths, changes)

    def run_cells(self) -> None:
        """Run each cell. One that fails says so, and the next one runs."""
        status = self.result["status"].to_numpy()
        for index, cell in self._cells.items():
            if cell is None:
                status[index] = MEANS_NOTHING
            elif self._was_too_slow(index):
                status[index] = f"{STOPPED}: a longer step took too long"
            else:
                self._run_cell(index, cell)
            self._done += 1
            self._watch(StudyProgress(in_words(self._settings[index]), self._done, self._total))

    def _run_cell(self, index: tuple[int, ...], cell: Scenario) -> None:
        limit = _TimeLimit(self._limit)
        watch = self._progress_of(in_words(self._settings[index]))

        def progress(at: Progress) -> None:
            watch(at)
            limit.check(at)

        try:
            record(self.result, index, run(cell, progress=progress), self._reference)
        except Interrupted:
            raise
        except SimulationError as error:
            reason = STOPPED if limit.exceeded else "failed"
            self.result["status"].to_numpy()[index] = f"{reason}: {error}"

    def _was_too_slow(self, index: tuple[int, ...]) -> bool:
        """Tell whether the same setting was stopped at the next coarser value of a dearer axis."""
        status = self.result["status"]
        for position, name in enumerate(status.dims):
            coarser = (*index[:position], index[position] - 1, *index[position + 1 :])
            if AXES[str(name)].dearer and index[position] > 0:
                return str(status.to_numpy()[coarser]).startswith(STOPPED)
        return False

    def _progress_of(self, name: str) -> Callable[[Progress], None]:
        """Report the progress of a run as that of its part of the grid."""
        part = StudyProgress(name, self._done, self._total)
        return lambda at: self._watch(replace(part, done=part.done + at.time / at.duration))


class _TimeLimit:
    """Ends a run that takes longer than it may."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self.exceeded = False

    def check(self, at: Progress) -> None:
        """Raise `SimulationError` if it does."""
        if at.wall_time > self._seconds:
            self.exceeded = True
            raise SimulationError(f"it took more than {self._seconds:g} s")
