"""A scenario at work: its participants in step, and what is recorded of them."""

from __future__ import annotations

import dataclasses
import json
import time as clock

import xarray as xr

from cosim import CoSimulation, Recorder
from scenarios.running.checkpoint import SessionState
from scenarios.running.participants import Participants
from scenarios.running.progress import Progress
from scenarios.running.snapshots import Snapshots
from scenarios.running.variables import variables_of
from scenarios.scene.scenario import Scenario
from softbody_core import Counters


class Session:
    """Participants, the loop over them, and what it gave so far.

    Parameters
    ----------
    scenario : Scenario
        Of the run.
    participants : Participants
        That run.
    positions_every : float or None
        Interval of the snapshots, s.

    Attributes
    ----------
    scenario : Scenario
        Of the run.
    points : int
        Communication points so far; the start is one.
    """

    def __init__(
        self, scenario: Scenario, participants: Participants, positions_every: float | None
    ) -> None:
        self.scenario, self._participants = scenario, participants
        bodies = participants.bodies
        connections = participants.connections(scenario)
        self._recorder = Recorder(participants.all, variables_of(bodies, participants.controller))
        self._snapshots = [
            Snapshots(body.body, scenario, positions_every, f"{body.name}_" * (len(bodies) > 1))
            for body in bodies
        ]
        self._simulation = CoSimulation(
            participants.all,
            connections,
            step=scenario.coupling.step,
            algorithm=scenario.coupling.algorithm,
        )
        self.points = 0
        self._time = 0.0
        self._started = clock.perf_counter()

    @property
    def finished(self) -> bool:
        """Whether the last communication point is reached."""
        return self.points > self.scenario.steps

    def advance(self) -> None:
        """Go to the next communication point, the first one first, and record it."""
        point = self._simulation.advance() if self.points else self._simulation.begin()
        if not self.points:
            self._started = clock.perf_counter()
        self._recorder.record(point)
        for snapshots in self._snapshots:
            snapshots.take(point.index)
        self.points += 1
        self._time = point.time

    @property
    def wall_time(self) -> float:
        """Computing time without set-up, s."""
        return clock.perf_counter() - self._started

    @property
    def counters(self) -> Counters:
        """What the integrators have done."""
        done = [dataclasses.astuple(body.body.counters) for body in self._participants.bodies]
        return Counters(*map(sum, zip(*done, strict=True)))

    @property
    def progress(self) -> Progress:
        """How far it has come."""
        duration = self.scenario.steps * self.scenario.coupling.step
        return Progress(self._time, duration, self.wall_time, self.counters)

    def serialize(self) -> SessionState:
        """Where it stands, for a file.

        Raises
        ------
        CouplingError
            If the state of a participant cannot be written down.
        """
        controller = self._participants.controller
        warnings = [] if controller is None else list(controller.log.warnings)
        arrays = {"recorded": self._recorder.serialize()}
        for snapshots in self._snapshots:
            arrays |= snapshots.serialize()
        return SessionState(self._simulation.serialize(), arrays, self.wall_time, warnings)

    def deserialize(self, state: SessionState) -> None:
        """Begin where `serialize` was called. What follows repeats to the bit."""
        self._simulation.begin()
        self._simulation.deserialize(state.loop)
        self._recorder.deserialize(state.arrays["recorded"])
        for snapshots in self._snapshots:
            snapshots.deserialize(state.arrays)
        self.points = state.loop.index + 1
        if self._participants.controller is not None:
            self._participants.controller.log.warnings[:] = state.warnings
        self._started = clock.perf_counter() - state.wall_time

    def dataset(self) -> xr.Dataset:
        """Everything that was recorded, without attributes."""
        dataset = self._recorder.dataset()
        for snapshots in self._snapshots:
            dataset = snapshots.add_to(dataset)
        return dataset

    def attributes(self) -> dict[str, object]:
        """What a dataset says of the controller, if there is one, and of the work that was done."""
        return {
            **self._controller_attributes(),
            "integrator": repr(self.scenario.integrator),
            **dataclasses.asdict(self.counters),
            "wall_time": self.wall_time,
        }

    def _controller_attributes(self) -> dict[str, str]:
        controller, fmu = self.scenario.controller, self._participants.controller
        if controller is None or fmu is None:
            return {}
        attributes = {
            "controller": controller.use,
            "controller_parameters": json.dumps(controller.parameters),
            "controller_sha256": fmu.sha256,
        }
        if fmu.log.warnings:
            attributes["controller_warnings"] = "\n".join(fmu.log.warnings)
        return attributes
