"""From a scenario to the participants that run it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Final

from cosim import (
    Causality,
    Connection,
    FmuParticipant,
    Port,
    SoftBodyParticipant,
    WiringError,
    quantity,
)
from cosim.controllers import CONTROLLERS, controller_fmu
from cosim.errors import nearest
from cosim.matching import PortName, match
from scenarios.errors import ScenarioError
from scenarios.scene.controller import Controller
from scenarios.scene.scenario import Scenario
from scenarios.scene.schema import Mesh, Obstacle
from scenarios.scene.shipped import MESHES
from scenarios.scene.tables import choose
from softbody_core import (
    ParameterError,
    RigidBody,
    SimulationError,
    SoftBody,
    SoftBodyModel,
    SurfaceMesh,
    fibonacci_sphere,
    icosphere,
    wine_glass,
)

ADDING: Final = ("volume", "bounding_box_volume", "flow")
"""Outputs of bodies that add up to those of all together."""

_SURPRISING_VOLUME: Final = 1.0
"""More than any animal's lungs, m³: a file in millimetres is read as metres too often."""


def build_body(scenario: Scenario) -> SoftBody:
    """Make the body of a scenario, at rest.

    Raises
    ------
    ScenarioError
        If the mesh does not fit, or there are several bodies; the message says why.
    """
    if scenario.bodies:
        raise ScenarioError(
            f"scenario {scenario.name} has several bodies, and this takes one; each is a scenario "
            f"of its own in Scenario.bodies: {', '.join(scenario.bodies)}"
        )
    mesh = build_mesh(scenario.mesh, scenario.folder)
    constraints = list(scenario.constraints)
    if scenario.obstacles:
        bodies = tuple(_rigid(obstacle, scenario.folder) for obstacle in scenario.obstacles)
        constraints.append(replace(scenario.contact, bodies=bodies))
    try:
        model = SoftBodyModel(
            mesh, scenario.body.mass, scenario.forces, scenario.weights, constraints
        )
        return SoftBody(model, scenario.integrator)
    except ParameterError as error:
        raise ScenarioError(str(error)) from error


def build_participants(scenario: Scenario) -> list[SoftBodyParticipant]:
    """Make all bodies of a scenario; a single one is named "body"."""
    return [
        SoftBodyParticipant(build_body(body), name, inputs=scenario.inputs)
        for name, body in (scenario.bodies or {"body": scenario}).items()
    ]


def _rigid(obstacle: Obstacle, folder: Path) -> RigidBody:
    path = f"obstacles.{obstacle.name}"
    values = {field.name: getattr(obstacle, field.name) for field in fields(obstacle)}
    try:
        return RigidBody(**{**values, "mesh": build_mesh(obstacle.mesh, folder, f"{path}.mesh")})
    except ParameterError as error:
        raise ScenarioError(f"{path}: {error}") from error


def build_mesh(mesh: Mesh, folder: Path, path: str = "mesh") -> SurfaceMesh:
    """Read or make the surface, scale it, and put it in its place; `path` is for messages."""
    try:
        surface = _surface(mesh, folder)
        if mesh.volume is not None:
            surface = surface.scaled_to_volume(mesh.volume)
        return surface.moved(mesh.position) if any(mesh.position) else surface
    except ScenarioError:
        raise
    except SimulationError as error:
        raise ScenarioError(f"{path}: {error}") from error


def _surface(mesh: Mesh, folder: Path) -> SurfaceMesh:
    if mesh.icosphere is not None:
        return icosphere(mesh.icosphere)
    if mesh.ball is not None:
        return fibonacci_sphere(mesh.ball)
    if mesh.glass is not None:
        return wine_glass(mesh.glass)
    if mesh.file is not None:
        return _from_file(mesh, folder / mesh.file)
    shipped = {path.stem: path for path in MESHES.glob("*.ply")}
    return SurfaceMesh.from_file(choose(mesh.lung, shipped, "mesh.lung"))


def _from_file(mesh: Mesh, path: Path) -> SurfaceMesh:
    surface = SurfaceMesh.from_file(path, weld=mesh.weld)
    if mesh.unit is not None:
        return surface.scaled(quantity(f"1 {mesh.unit}", "m"))
    if mesh.volume is None and surface.volume > _SURPRISING_VOLUME:
        raise ScenarioError(
            f"mesh.file {path} encloses {surface.volume:.3g} m³ if its coordinates are metres; say "
            'mesh.unit = "mm" or what they are ("m" if they are), or give mesh.volume'
        )
    return surface


def controller_path(controller: Controller, folder: Path) -> Path:
    """FMU of the controller: a file's path; or built, if need be, of one that ships or a source."""
    if controller.use.endswith(".fmu"):
        return folder / controller.use
    if not controller.is_file and controller.use not in CONTROLLERS:
        raise ScenarioError(
            f"controller.use = {controller.use!r}: {nearest(controller.use, CONTROLLERS)}. "
            "An FMU ends in .fmu, a controller's source in .py"
        )
    return controller_fmu(controller.use, folder)


def connect(
    fmu: FmuParticipant,
    body_ports: Mapping[str, Port],
    names: Mapping[str, PortName] | None = None,
    bodies: Sequence[str] = ("body",),
) -> list[Connection]:
    """Connect a controller and the body, port by port; or several bodies, as if they were one.

    All of them take what the controller gives, and it takes the sums of what adds up.

    Parameters
    ----------
    fmu : FmuParticipant
        The controller. It has to give ``delta_p`` or ``n``; what it does not give stays 0.
    body_ports : mapping
        The body's.
    names : mapping, optional
        By port of the body: its name in the FMU, where that differs.
    bodies : sequence of str
        Names of the participants.

    Raises
    ------
    WiringError
        If the FMU drives nothing, takes something that the body does not give, or has no port of
        a given name.
    """
    if len(bodies) > 1:
        body_ports = {
            name: port
            for name, port in body_ports.items()
            if port.causality is Causality.INPUT or name in ADDING
        }
        for name in names or {}:
            choose(name, body_ports, "controller.ports")
    matching = match(fmu.ports, body_ports, names or {})
    if matching.faults:
        fault = matching.faults[0]
        raise WiringError(f"FMU {fmu.path} {fault.text}", fault.settings)
    connections = []
    for variable, port in matching.pairs:
        ends = [f"{body}.{port}" for body in bodies]
        if body_ports[port].causality is Causality.INPUT:
            connections += [Connection(f"{fmu.name}.{variable}", end) for end in ends]
        else:
            connections.append(Connection(ends[0], f"{fmu.name}.{variable}", tuple(ends[1:])))
    return connections
