"""Run a scenario: participants in step, and a dataset of what they did."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import xarray as xr

from cosim.loop import require_serialization
from scenarios.errors import CheckpointError, Interrupted, RunError, ScenarioError
from scenarios.running.checkpoint import Checkpoints, read
from scenarios.running.machine import machine, versions
from scenarios.running.participants import open_participants
from scenarios.running.progress import Progress, unwatched
from scenarios.running.provenance import Provenance
from scenarios.running.session import Session
from scenarios.scene.parse import parse
from scenarios.scene.scenario import Scenario
from scenarios.scene.setting_paths import message_with_paths
from softbody_core import SimulationError

COMPLETED: Final = "completed"


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
        It is an `Interrupted` where someone interrupted it.
    """
    if not isinstance(scenario, Scenario):
        raise ScenarioError(
            f"scenario = {scenario!r}: expected a Scenario; read one with "
            f"softbody.load({scenario!r})"
        )
    if controller is not None:
        scenario = scenario.draft.with_controller(controller).build(si=True)
    with open_participants(scenario) as participants:
        session = Session(scenario, participants, positions_every)
        if checkpoints is not None:
            require_serialization(participants.all)
        fmu = participants.controller
        provenance = Provenance(
            scenario.name,
            scenario.portable_text,
            positions_every,
            None if fmu is None else fmu.sha256,
            versions(),
            machine(),
        )
        return _advance_to_the_end(session, provenance, checkpoints, progress or unwatched)


def resume(path: str | Path, *, progress: Callable[[Progress], None] | None = None) -> xr.Dataset:
    """Go on with a run from its checkpoint, and return the dataset of the whole.

    It is the dataset of the unbroken run to the bit, but for ``wall_time``. With other versions of
    libraries, or on another machine, bits may differ from there on; these are then in the attribute
    ``resumed_with``.

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
    checkpoint = read(Path(path))
    provenance = checkpoint.provenance
    written = provenance.versions["softbody-cosim"]
    if written != versions()["softbody-cosim"]:
        raise CheckpointError(
            f"checkpoint {path} was written by softbody-cosim {written}, and this is "
            f"{versions()['softbody-cosim']}; resume it with that version"
        )
    scenario = parse(provenance.scenario_name, provenance.scenario, Path.cwd())
    checkpoints = Checkpoints(Path(path), checkpoint.every, checkpoint.attributes)
    with open_participants(scenario, provenance.controller_sha256) as participants:
        session = Session(scenario, participants, provenance.positions_every)
        require_serialization(participants.all)
        session.deserialize(checkpoint.state)
        return _advance_to_the_end(session, provenance, checkpoints, progress or unwatched)


def _advance_to_the_end(
    session: Session,
    provenance: Provenance,
    checkpoints: Checkpoints | None,
    progress: Callable[[Progress], None],
) -> xr.Dataset:
    """Let a session advance to its end; an error on the way takes along what there is."""
    extra = {} if checkpoints is None else checkpoints.attributes
    try:
        while not session.finished:
            session.advance()
            if checkpoints is not None and checkpoints.due(session.points - 1):
                checkpoints.write(provenance, session.serialize())
            progress(session.progress)
    except KeyboardInterrupt as error:
        if session.points == 0:
            raise
        dataset = _dataset(session, provenance, "interrupted", extra)
        raise Interrupted("interrupted", dataset) from error
    except SimulationError as error:
        if session.points == 0:
            raise
        message = message_with_paths(error)
        dataset = _dataset(session, provenance, f"failed: {message}", extra)
        raise RunError(message, dataset) from error
    return _dataset(session, provenance, COMPLETED, extra)


def _dataset(
    session: Session, provenance: Provenance, status: str, extra: Mapping[str, Any]
) -> xr.Dataset:
    """What was recorded, with all that it takes to have it again."""
    attributes = {
        "title": session.scenario.title,
        **provenance.attributes(),
        **session.attributes(),
        "status": status,
        **extra,
    }
    now = {**versions(), **machine()}
    if now != {**provenance.versions, **provenance.machine}:
        attributes["resumed_with"] = json.dumps(now)
    return session.dataset().assign_attrs(attributes)
