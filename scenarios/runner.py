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

from cosim import (
    ALGORITHMS,
    FmuParticipant,
    Participant,
    Recorder,
    SoftBodyParticipant,
    cosimulate,
)
from cosim.isolation import open_fmu
from cosim.matching import with_units
from scenarios.assemble import build_body, connect, controller_path
from scenarios.errors import RunError, ScenarioError
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
    chosen = scenario.controller
    if chosen is None:
        return _run(scenario, body, None, positions_every, progress)
    path = controller_path(chosen, scenario.folder)
    fmu = open_fmu(
        path,
        "controller",
        chosen.parameters,
        isolation=chosen.isolation.isolation,
        time_limit=chosen.isolation.time_limit,
    )
    try:
        fmu.ports = with_units(fmu.ports, chosen.ports)
        fmu.check_step(scenario.coupling.step)
        return _run(scenario, body, fmu, positions_every, progress)
    finally:
        fmu.close()


def with_controller(scenario: Scenario, controller: str | Path) -> Scenario:
    """Return the scenario with another controller, and the parameters it holds for that one."""
    if scenario.controller is None:
        raise ScenarioError(
            f"scenario {scenario.name} has no controller to replace: its inputs are held (table "
            "[inputs]); give it a table [controller] instead"
        )
    use = str(controller)
    if use.endswith(".fmu"):
        use = str(Path(use).resolve())
    return scenario.changed({"controller.use": use})


def _run(
    scenario: Scenario,
    body: SoftBody,
    fmu: FmuParticipant | None,
    positions_every: float | None,
    progress: Callable[[Progress], None] | None,
) -> xr.Dataset:
    soft_body = SoftBodyParticipant(body, inputs=scenario.inputs)
    participants: list[Participant] = [soft_body] if fmu is None else [fmu, soft_body]
    connections = []
    if fmu is not None and scenario.controller is not None:
        connections = connect(fmu, soft_body.ports, scenario.controller.ports)
    recorder = Recorder(participants, variables_of(soft_body, fmu))
    snapshots = Snapshots(body, scenario, positions_every)
    duration = scenario.steps * scenario.coupling.step
    status = COMPLETED
    failure: BaseException | None = None
    started = clock.perf_counter()
    reached = 0
    try:
        for point in cosimulate(
            participants,
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
        "scenario": portable(scenario).text,
        "scenario_name": scenario.name,
        "versions": json.dumps(versions()),
        **_controller_attributes(scenario, fmu),
        "integrator": repr(scenario.integrator),
        **dataclasses.asdict(body.work),
        "wall_time": wall_time,
        "status": status,
    }
    if failure is not None:
        reason = "interrupted" if isinstance(failure, KeyboardInterrupt) else str(failure)
        raise RunError(reason, dataset) from failure
    return dataset


def _controller_attributes(scenario: Scenario, fmu: FmuParticipant | None) -> dict[str, str]:
    """What a dataset says of its controller, if the scene has one."""
    if scenario.controller is None or fmu is None:
        return {}
    attributes = {
        "controller": scenario.controller.use,
        "controller_parameters": json.dumps(scenario.controller.parameters),
        "controller_sha256": fmu.sha256,
    }
    if fmu.log.warnings:
        attributes["controller_warnings"] = "\n".join(fmu.log.warnings)
    return attributes


def portable(scenario: Scenario) -> Scenario:
    """Return the scenario with paths that hold wherever its text is saved."""
    changes = {}
    if scenario.mesh.file is not None:
        changes["mesh.file"] = str(scenario.folder / scenario.mesh.file)
    for obstacle in scenario.obstacles:
        if obstacle.mesh.file is not None:
            path = str(scenario.folder / obstacle.mesh.file)
            changes[f"obstacles.{obstacle.name}.mesh.file"] = path
    if scenario.controller is not None and scenario.controller.use.endswith(".fmu"):
        changes["controller.use"] = str(scenario.folder / scenario.controller.use)
    return scenario.changed(changes) if changes else scenario


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries that decide a result."""
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}
