"""From a scenario to the participants that run it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from cosim import Causality, Connection, FmuParticipant, Port, WiringError, quantity
from cosim.controllers import CONTROLLERS, controller_fmu
from cosim.errors import nearest
from scenarios.catalogue import MESHES
from scenarios.decode import choose
from scenarios.errors import ScenarioError
from scenarios.schema import Controller, Mesh, Scenario
from softbody_core import SoftBody, SoftBodyError, SoftBodyModel, SurfaceMesh, ball, icosphere

_SURPRISING_VOLUME: Final = 1.0
"""More than any animal's lungs, m³: a file in millimetres is read as metres too often."""


def build_body(scenario: Scenario) -> SoftBody:
    """Make the body of a scenario, at rest.

    Raises
    ------
    ScenarioError
        If the mesh does not fit; the message says why.
    """
    model = SoftBodyModel(
        build_mesh(scenario.mesh, scenario.folder),
        scenario.body.mass,
        scenario.forces,
        scenario.weights,
        scenario.constraints,
    )
    return SoftBody(model, scenario.integrator)


def build_mesh(mesh: Mesh, folder: Path) -> SurfaceMesh:
    """Read or make the surface, and scale it."""
    try:
        surface = _surface(mesh, folder)
        return surface if mesh.volume is None else surface.scaled_to_volume(mesh.volume)
    except ScenarioError:
        raise
    except SoftBodyError as error:
        raise ScenarioError(f"mesh: {error}") from error


def _surface(mesh: Mesh, folder: Path) -> SurfaceMesh:
    if mesh.icosphere is not None:
        return icosphere(mesh.icosphere)
    if mesh.ball is not None:
        return ball(mesh.ball)
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
    """FMU of the controller: a file's path, or one that ships, built if need be."""
    if controller.use.endswith(".fmu"):
        return folder / controller.use
    if controller.use not in CONTROLLERS:
        raise ScenarioError(
            f"controller.use = {controller.use!r}: {nearest(controller.use, CONTROLLERS)}. "
            "An FMU file ends in .fmu"
        )
    return controller_fmu(controller.use)


def connect(fmu: FmuParticipant, body_ports: Mapping[str, Port]) -> list[Connection]:
    """Connect a controller and the body, port by port of the same name.

    Parameters
    ----------
    fmu : FmuParticipant
        The controller. It has to give ``delta_p`` or ``n``; what it does not give stays 0.
    body_ports : mapping
        The body's.

    Raises
    ------
    WiringError
        If the FMU drives nothing, or takes something that the body does not give.
    """
    gives = {n for n, p in fmu.ports.items() if p.causality is Causality.OUTPUT}
    takes = [n for n, p in fmu.ports.items() if p.causality is Causality.INPUT]
    offered = {n for n, p in body_ports.items() if p.causality is Causality.OUTPUT}
    driven = [n for n, p in body_ports.items() if p.causality is Causality.INPUT and n in gives]
    if not driven:
        raise WiringError(
            f"FMU {fmu.path} cannot drive the body: it has neither an output delta_p (Pa) nor an "
            f"output n (1); its outputs are: {', '.join(sorted(gives)) or 'none'}"
        )
    for name in takes:
        if name not in offered:
            raise WiringError(
                f"FMU {fmu.path} has an input {name!r} that the body does not give; "
                f"{nearest(name, offered)}"
            )
    return [
        *(Connection(f"{fmu.name}.{name}", f"body.{name}") for name in driven),
        *(Connection(f"body.{name}", f"{fmu.name}.{name}") for name in takes),
    ]
