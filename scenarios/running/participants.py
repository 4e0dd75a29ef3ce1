"""The participants of a scenario: opened for a run, and closed after it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cosim import Connection, FmuParticipant, Participant, SoftBodyParticipant
from cosim.fmu.isolation import open_fmu
from cosim.matching import with_units
from scenarios.errors import CheckpointError
from scenarios.running.assemble import build_participants, connect, controller_path
from scenarios.scene.controller import Controller
from scenarios.scene.scenario import Scenario
from scenarios.scene.setting_paths import errors_with_paths


@dataclass(frozen=True)
class Participants:
    """What a scenario runs.

    Attributes
    ----------
    bodies : sequence of SoftBodyParticipant
        All bodies, in order.
    controller : FmuParticipant or None
        What drives them, if their inputs are not held.
    """

    bodies: Sequence[SoftBodyParticipant]
    controller: FmuParticipant | None = None

    @property
    def all(self) -> list[Participant]:
        """All of them, the controller first."""
        return [*([] if self.controller is None else [self.controller]), *self.bodies]

    def connections(self, scenario: Scenario) -> list[Connection]:
        """Connect the controller with the bodies."""
        if self.controller is None or scenario.controller is None:
            return []
        names = [body.name for body in self.bodies]
        ports = scenario.controller.ports
        return connect(self.controller, self.bodies[0].ports, ports, names)


@contextmanager
def open_participants(
    scenario: Scenario, controller_sha256: str | None = None
) -> Iterator[Participants]:
    """Make the bodies of a scenario and open its controller; close it in the end.

    Parameters
    ----------
    scenario : Scenario
        What to run.
    controller_sha256 : str, optional
        Hash that the controller's FMU has to have.

    Raises
    ------
    ScenarioError, MeshError, FmuError
        If a participant cannot be made.
    CheckpointError
        If the FMU has another hash.
    """
    bodies = build_participants(scenario)
    if scenario.controller is None:
        yield Participants(bodies)
        return
    path = controller_path(scenario.controller, scenario.folder)
    if controller_sha256 is not None and path.is_file():
        _check_hash(path, controller_sha256)
    controller = _open_controller(scenario.controller, path)
    try:
        controller.ports = with_units(controller.ports, scenario.controller.ports)
        with errors_with_paths():
            controller.check_step(scenario.coupling.step)
            yield Participants(bodies, controller)
    finally:
        controller.close()


def _open_controller(controller: Controller, path: Path) -> FmuParticipant:
    return open_fmu(
        path,
        "controller",
        controller.parameters,
        run_as=controller.isolation.run_as,
        isolation=controller.isolation.isolation,
        time_limit=controller.isolation.time_limit,
    )


def _check_hash(path: Path, expected: str) -> None:
    """Raise `CheckpointError` unless an FMU is the one that a checkpoint was written with."""
    actual = hashlib.sha256(path.read_bytes()).hexdigest()
    if actual != expected:
        raise CheckpointError(
            f"FMU {path} is not the one that the checkpoint was written with: its hash is "
            f"{actual[:16]}…, and then it was {expected[:16]}…. Put that FMU back, or run again"
        )
