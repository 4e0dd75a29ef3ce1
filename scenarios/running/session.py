"""A scenario at work: its participants in step, and what is recorded of them."""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Mapping, Sequence
from typing import Any

import xarray as xr

from cosim import CoSimulation, FmuParticipant, Participant, Recorder, SoftBodyParticipant
from scenarios.running.assemble import connect
from scenarios.running.checkpoint import Kept
from scenarios.running.snapshots import Snapshots
from scenarios.running.variables import variables_of
from scenarios.scene.scenario import Scenario
from softbody_core import Work


class Session:
    """Participants, the loop over them, and what it gave so far.

    Parameters
    ----------
    scenario : Scenario
        Of the run.
    bodies : sequence of SoftBodyParticipant
        Its bodies.
    fmu : FmuParticipant or None
        Its controller.
    positions_every : float or None
        Interval of the snapshots, s.

    Attributes
    ----------
    participants : list of Participant
        The controller first.
    reached : int
        Communication points so far; the start is one.
    """

    def __init__(
        self,
        scenario: Scenario,
        bodies: Sequence[SoftBodyParticipant],
        fmu: FmuParticipant | None,
        positions_every: float | None,
    ) -> None:
        self._name, self._bodies, self._fmu = scenario.name, bodies, fmu
        self.participants: list[Participant] = [*([] if fmu is None else [fmu]), *bodies]
        connections = []
        if fmu is not None and scenario.controller is not None:
            names = [body.name for body in bodies]
            connections = connect(fmu, bodies[0].ports, scenario.controller.ports, names)
        self._recorder = Recorder(self.participants, variables_of(bodies, fmu))
        self._snapshots = [
            Snapshots(body.body, scenario, positions_every, f"{body.name}_" * (len(bodies) > 1))
            for body in bodies
        ]
        self._simulation = CoSimulation(
            self.participants,
            connections,
            step=scenario.coupling.step,
            algorithm=scenario.coupling.algorithm,
        )
        self.reached = 0
        self._started = clock.perf_counter()

    def advance(self) -> float:
        """Go to the next communication point, the first one first; return its time, s."""
        point = self._simulation.advance() if self.reached else self._simulation.begin()
        if not self.reached:
            self._started = clock.perf_counter()
        self._recorder.record(point)
        for snapshots in self._snapshots:
            snapshots.take(point.index)
        self.reached += 1
        return point.time

    @property
    def wall_time(self) -> float:
        """Computing time without set-up, s."""
        return clock.perf_counter() - self._started

    @property
    def work(self) -> Work:
        """What the integrators have done."""
        done = [dataclasses.astuple(body.body.work) for body in self._bodies]
        return Work(*map(sum, zip(*done, strict=True)))

    def dataset(self) -> xr.Dataset:
        """Everything that was recorded, without attributes."""
        dataset = self._recorder.dataset()
        for snapshots in self._snapshots:
            dataset = snapshots.add_to(dataset)
        return dataset

    def kept(self, text: str, about: Mapping[str, Any]) -> Kept:
        """All that a checkpoint holds; `text` is the scenario's."""
        warnings = [] if self._fmu is None else self._fmu.log.warnings
        arrays = {"recorded": self._recorder.kept()}
        for snapshots in self._snapshots:
            arrays |= snapshots.kept()
        return Kept(
            self._name,
            text,
            self._simulation.dump(),
            arrays,
            {**about, "wall_time": self.wall_time, "warnings": list(warnings)},
        )

    def keep(self, kept: Kept) -> None:
        """Begin where a checkpoint ends."""
        self._simulation.begin()
        self._simulation.load(kept.loop)
        self._recorder.keep(kept.arrays["recorded"])
        for snapshots in self._snapshots:
            snapshots.keep(kept.arrays)
        self.reached = kept.loop.index + 1
        if self._fmu is not None:
            self._fmu.log.warnings[:] = kept.about["warnings"]
        self._started = clock.perf_counter() - kept.about["wall_time"]
