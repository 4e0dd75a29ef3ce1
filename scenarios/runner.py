"""Run a scenario: participants in step, and a dataset of what they did."""

from __future__ import annotations

import json
import platform
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from cosim import ALGORITHMS, FmuParticipant, Recorder, SoftBodyParticipant, cosimulate
from scenarios.assemble import build_body, connect, controller_path
from scenarios.errors import RunError, ScenarioError
from scenarios.schema import Scenario
from scenarios.variables import variables_of
from softbody_core import SoftBody, SoftBodyError

COMPLETED: Final = "completed"

_PACKAGES: Final = [
    "softbody-cosim",
    "numpy",
    "scipy",
    "fmpy",
    "trimesh",
    "xarray",
    "netCDF4",
    "pythonfmu",
]


@dataclass(frozen=True)
class Progress:
    """How far a run has come.

    Attributes
    ----------
    time, duration : float
        Simulated so far, and in all, s.
    wall_time : float
        Computing time so far, s.
    """

    time: float
    duration: float
    wall_time: float


def run(
    scenario: Scenario,
    controller: str | Path | None = None,
    *,
    positions_every: float | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> xr.Dataset:
    """Run a scenario and return its dataset.

    Parameters
    ----------
    scenario : Scenario
        From `scenarios.load`.
    controller : str or Path, optional
        Another controller: one that ships, by name, or an FMU file.
    positions_every : float, optional
        Also keep the positions of all points each so many seconds, at communication points.
    progress : callable, optional
        Called at each communication point.

    Returns
    -------
    xarray.Dataset
        See ``docs/dataset.md``. The first sample is the body at rest, before any input.

    Raises
    ------
    ScenarioError, FmuError, WiringError, MeshError
        If the scenario cannot start.
    RunError
        If the run ended early, by divergence or a failing FMU; its ``dataset`` holds the good part.
    """
    if controller is not None:
        scenario = with_controller(scenario, controller)
    body = build_body(scenario)
    path = controller_path(scenario.controller, scenario.folder)
    fmu = FmuParticipant(path, "controller", scenario.controller.parameters)
    try:
        return _run(scenario, body, fmu, positions_every, progress)
    finally:
        fmu.close()


def with_controller(scenario: Scenario, controller: str | Path) -> Scenario:
    """Return the scenario with another controller, and the parameters it holds for that one."""
    use = str(controller)
    if use.endswith(".fmu"):
        use = str(Path(use).resolve())
    return scenario.changed({"controller.use": use})


def _run(
    scenario: Scenario,
    body: SoftBody,
    fmu: FmuParticipant,
    positions_every: float | None,
    progress: Callable[[Progress], None] | None,
) -> xr.Dataset:
    soft_body = SoftBodyParticipant(body)
    connections = connect(fmu, soft_body.ports)
    recorder = Recorder([fmu, soft_body], variables_of(fmu))
    snapshots = Snapshots(body, scenario, positions_every)
    duration = scenario.steps * scenario.coupling.step
    status = COMPLETED
    failure: BaseException | None = None
    started = clock.perf_counter()
    reached = 0
    try:
        for point in cosimulate(
            [fmu, soft_body],
            connections,
            step=scenario.coupling.step,
            steps=scenario.steps,
            algorithm=ALGORITHMS[scenario.coupling.algorithm](),
        ):
            if point.index == 0:
                started = clock.perf_counter()
            recorder.record(point)
            snapshots.take(point.index)
            reached += 1
            if progress is not None:
                progress(Progress(point.time, duration, clock.perf_counter() - started))
    except (SoftBodyError, KeyboardInterrupt) as error:
        if reached == 0:
            raise
        failure = error
        status = "interrupted" if isinstance(error, KeyboardInterrupt) else f"failed: {error}"
    wall_time = clock.perf_counter() - started
    dataset = snapshots.add_to(recorder.dataset())
    dataset.attrs = {
        "title": scenario.title,
        "scenario": scenario.text,
        "scenario_name": scenario.name,
        "versions": json.dumps(_versions()),
        "controller": scenario.controller.use,
        "controller_sha256": fmu.sha256,
        "integrator": repr(scenario.integrator),
        "steps": body.steps,
        "wall_time": wall_time,
        "status": status,
    }
    if failure is not None:
        reason = "interrupted" if isinstance(failure, KeyboardInterrupt) else str(failure)
        raise RunError(reason, dataset) from failure
    return dataset


class Snapshots:
    """Positions of all points at chosen communication points.

    Parameters
    ----------
    body : SoftBody
        Whose points.
    scenario : Scenario
        For the communication step.
    every : float or None
        Interval, s; None keeps nothing.
    """

    def __init__(self, body: SoftBody, scenario: Scenario, every: float | None) -> None:
        self._body = body
        self._stride = 0
        if every is not None:
            strides = every / scenario.coupling.step
            self._stride = round(strides) if np.isfinite(strides) else 0
            if self._stride < 1:
                raise ScenarioError(
                    f"positions every {every:g} s: expected at least one communication step, "
                    f"{scenario.coupling.step:.6g} s"
                )
        self._times: list[float] = []
        self._positions: list[np.ndarray] = []

    def take(self, index: int) -> None:
        """Keep the positions if it is time to."""
        if self._stride and index % self._stride == 0:
            self._times.append(self._body.time)
            self._positions.append(self._body.positions)

    def add_to(self, dataset: xr.Dataset) -> xr.Dataset:
        """Add what was kept to a dataset."""
        if not self._stride:
            return dataset
        said = {"units": "m", "long_name": "point position"}
        time = {"units": "s", "long_name": "time of the snapshot"}
        corners = {"units": "1", "long_name": "point indices of the triangles, outward"}
        return dataset.assign(
            position=(("snapshot", "point", "axis"), np.stack(self._positions), said),
            triangles=(("triangle", "corner"), self._body.model.mesh.triangles, corners),
        ).assign_coords(snapshot_time=("snapshot", np.array(self._times), time))


def _versions() -> dict[str, str]:
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}
