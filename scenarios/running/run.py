"""Run a scenario: participants in step, and a dataset of what they did."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import xarray as xr

from cosim import FmuParticipant, SoftBodyParticipant
from cosim.fmu.isolation import open_fmu
from cosim.loop import require_dump
from cosim.matching import with_units
from scenarios.errors import CheckpointError, RunError, ScenarioError
from scenarios.running.assemble import build_participants, controller_path
from scenarios.running.checkpoint import Checkpoints, Kept, read, write
from scenarios.running.session import Session
from scenarios.scene.controller import Controller
from scenarios.scene.parse import parse
from scenarios.scene.scenario import Scenario
from softbody_core import SimulationError, Work

COMPLETED: Final = "completed"

_PACKAGES: Final = [
    "softbody-cosim",
    "numpy",
    "scipy",
    "fmpy",
    "trimesh",
    "libigl",
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


@dataclass(frozen=True)
class _Options:
    """What is asked of a run beside its scenario; see `run`."""

    positions_every: float | None
    checkpoints: Checkpoints | None
    progress: Callable[[Progress], None] | None


def run(
    scenario: Scenario,
    controller: str | Path | None = None,
    *,
    positions_every: float | None = None,
    checkpoints: Checkpoints | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> xr.Dataset:
    """Run a scenario and return its dataset.

    Parameters
    ----------
    scenario : Scenario
        From `scenarios.load`.
    controller : str or Path, optional
        Another controller: one that ships, by name, an FMU, or a Python file with a pythonfmu
        class.
    positions_every : float, optional
        Also keep the positions of all points each so many seconds, at communication points.
    checkpoints : Checkpoints, optional
        Where and how often to write what `resume` goes on from.
    progress : callable, optional
        Called at each communication point.

    Returns
    -------
    xarray.Dataset
        See ``docs/dataset.md``. The first sample is the body at rest, before any input.

    Raises
    ------
    ScenarioError, FmuError, WiringError, CouplingError, MeshError
        If the scenario cannot start.
    RunError
        If the run ended early, by divergence or a failing FMU; its ``dataset`` holds the good part.
    """
    if controller is not None:
        scenario = with_controller(scenario, controller)
    return _start(scenario, _Options(positions_every, checkpoints, progress))


def resume(path: str | Path, *, progress: Callable[[Progress], None] | None = None) -> xr.Dataset:
    """Go on with a run from its checkpoint, and return the dataset of the whole.

    It is the dataset of the unbroken run to the bit, but for ``wall_time``. With other versions of
    libraries, bits may differ from there on; they are then in the attribute ``resumed_with``.

    Parameters
    ----------
    path : str or Path
        Written by `run` with `checkpoints`. The run goes on to write there.
    progress : callable, optional
        As for `run`.

    Raises
    ------
    CheckpointError
        If the file cannot be read, was written by another version of this package, or the
        controller has changed since.
    RunError
        As `run` does.
    """
    kept = read(Path(path))
    written = kept.about["versions"]["softbody-cosim"]
    if written != versions()["softbody-cosim"]:
        raise CheckpointError(
            f"checkpoint {path} was written by softbody-cosim {written}, and this is "
            f"{versions()['softbody-cosim']}; resume it with that version"
        )
    scenario = parse(kept.name, kept.scenario, Path.cwd())
    about = kept.about
    checkpoints = Checkpoints(Path(path), about["every"], about["attributes"])
    return _start(scenario, _Options(about["positions_every"], checkpoints, progress), kept)


def _start(scenario: Scenario, options: _Options, kept: Kept | None = None) -> xr.Dataset:
    """Open what the scenario needs, run it, and close it."""
    bodies = build_participants(scenario)
    chosen = scenario.controller
    if chosen is None:
        return _run(scenario, bodies, None, options, kept)
    path = controller_path(chosen, scenario.folder)
    if kept is not None and path.is_file():
        _check_controller(path, kept.about["controller_sha256"])
    fmu = open_fmu(
        path,
        "controller",
        chosen.parameters,
        run_as=chosen.isolation.run_as,
        isolation=chosen.isolation.isolation,
        time_limit=chosen.isolation.time_limit,
    )
    try:
        fmu.ports = with_units(fmu.ports, chosen.ports)
        fmu.check_step(scenario.coupling.step)
        return _run(scenario, bodies, fmu, options, kept)
    finally:
        fmu.close()


def _check_controller(path: Path, expected: str) -> None:
    """Raise `CheckpointError` unless an FMU is the one that a checkpoint was written with."""
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    if found != expected:
        raise CheckpointError(
            f"FMU {path} is not the one that the checkpoint was written with: its hash is "
            f"{found[:16]}…, and then it was {expected[:16]}…. Put that FMU back, or run again"
        )


def with_controller(scenario: Scenario, controller: str | Path) -> Scenario:
    """Return the scenario with another controller, and the parameters it holds for that one."""
    if scenario.controller is None:
        raise ScenarioError(
            f"scenario {scenario.name} has no controller to replace: its inputs are held (table "
            "[inputs]); give it a table [controller] instead"
        )
    use = str(controller)
    if Controller(use).is_file:
        use = str(Path(use).resolve())
    return scenario.changed({"controller.use": use})


def _run(
    scenario: Scenario,
    bodies: Sequence[SoftBodyParticipant],
    fmu: FmuParticipant | None,
    options: _Options,
    kept: Kept | None,
) -> xr.Dataset:
    checkpoints = options.checkpoints
    session = Session(scenario, bodies, fmu, options.positions_every)
    text = scenario.portable_text
    about: dict[str, Any] = {
        "versions": versions() if kept is None else kept.about["versions"],
        "controller_sha256": None if fmu is None else fmu.sha256,
        "positions_every": options.positions_every,
    }
    if checkpoints is not None:
        require_dump(session.participants)
        about |= {"every": checkpoints.every, "attributes": dict(checkpoints.attributes)}
    if kept is not None:
        session.keep(kept)
    duration = scenario.steps * scenario.coupling.step
    status = COMPLETED
    failure: BaseException | None = None
    try:
        while session.reached <= scenario.steps:
            time = session.advance()
            steps = session.reached - 1
            if checkpoints is not None and steps and steps % checkpoints.every == 0:
                write(checkpoints.path, session.kept(text, about))
            if options.progress is not None:
                options.progress(Progress(time, duration, session.wall_time, session.work))
    except (SimulationError, KeyboardInterrupt) as error:
        if session.reached == 0:
            raise
        failure = error
        status = "interrupted" if isinstance(error, KeyboardInterrupt) else f"failed: {error}"
    wall_time = session.wall_time
    dataset = session.dataset()
    dataset.attrs = {
        "title": scenario.title,
        "scenario": text,
        "scenario_name": scenario.name,
        "versions": json.dumps(about["versions"]),
        **_controller_attributes(scenario, fmu),
        "integrator": repr(scenario.integrator),
        **dataclasses.asdict(session.work),
        "wall_time": wall_time,
        "status": status,
        **(checkpoints.attributes if checkpoints is not None else {}),
    }
    if about["versions"] != versions():
        dataset.attrs["resumed_with"] = json.dumps(versions())
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


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries that decide a result."""
    return {"python": platform.python_version(), **{name: version(name) for name in _PACKAGES}}
