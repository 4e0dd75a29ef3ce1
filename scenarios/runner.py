"""Run a scenario: participants in step, and a dataset of what they did."""

from __future__ import annotations

import dataclasses
import json
import platform
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Final

import xarray as xr

from cosim import ALGORITHMS, FmuParticipant, Recorder, SoftBodyParticipant, cosimulate
from scenarios.assemble import build_body, connect, controller_path
from scenarios.errors import RunError
from scenarios.schema import Scenario
from scenarios.snapshots import Snapshots
from scenarios.variables import variables_of
from softbody_core import SoftBody, SoftBodyError, Work

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
    work : Work
        What the integrator has done so far.
    """

    time: float
    duration: float
    wall_time: float
    work: Work


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
                elapsed = clock.perf_counter() - started
                progress(Progress(point.time, duration, elapsed, body.work))
    except (SoftBodyError, KeyboardInterrupt) as error:
        if reached == 0:
            raise
        failure = error
        status = "interrupted" if isinstance(error, KeyboardInterrupt) else f"failed: {error}"
    wall_time = clock.perf_counter() - started
    dataset = snapshots.add_to(recorder.dataset())
    dataset.attrs = {
        "title": scenario.title,
        "scenario": _portable(scenario).text,
        "scenario_name": scenario.name,
        "versions": json.dumps(_versions()),
        "controller": scenario.controller.use,
        "controller_parameters": json.dumps(scenario.controller.parameters),
        "controller_sha256": fmu.sha256,
        "integrator": repr(scenario.integrator),
        **dataclasses.asdict(body.work),
        "wall_time": wall_time,
        "status": status,
    }
    if failure is not None:
        reason = "interrupted" if isinstance(failure, KeyboardInterrupt) else str(failure)
        raise RunError(reason, dataset) from failure
    return dataset


def _portable(scenario: Scenario) -> Scenario:
    """Return the scenario with paths that hold wherever its text is saved."""
    changes = {}
    if scenario.mesh.file is not None:
        changes["mesh.file"] = str(scenario.folder / scenario.mesh.file)
    if scenario.controller.use.endswith(".fmu"):
        changes["controller.use"] = str(scenario.folder / scenario.controller.use)
    return scenario.changed(changes) if changes else scenario


def _versions() -> dict[str, str]:
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}
