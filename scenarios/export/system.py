"""A scenario's body and controller, wired, as an SSP."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from cosim import (
    Connection,
    FmuParticipant,
    Port,
    SoftBodyParticipant,
    UnitError,
    WiringError,
    unit,
)
from cosim.connection import Wiring
from cosim.controllers import controller_source
from cosim.export import Component, bound_parameters, build_configured, platforms_of, write_ssp
from cosim.fmu.parameters import Assignment
from cosim.matching import with_units
from scenarios.errors import ScenarioError
from scenarios.export.body import export_fmu
from scenarios.running.assemble import build_body, connect, controller_path
from scenarios.scene.controller import Controller
from scenarios.scene.scenario import Scenario
from scenarios.scene.setting_paths import errors_with_paths


def export_ssp(scenario: Scenario, path: Path) -> list[str]:
    """Write a scenario's body and controller as an SSP 1.0 archive of two FMUs.

    The body's ports bear the units of the controller's, so that no master has to convert. The
    controller's parameters are bound as the scenario sets them; one that ships is built with these
    values as well, because some masters leave bindings out.

    Parameters
    ----------
    scenario : Scenario
        What to write.
    path : Path
        The SSP.

    Returns
    -------
    list of str
        Platforms that both FMUs have binaries for, in FMI's words.

    Raises
    ------
    ScenarioError, MeshError, FmuError, WiringError
        If there is no controller, or body, controller or their connections are not as expected.
    """
    settings = scenario.controller
    if settings is None:
        raise ScenarioError(
            f"scenario {scenario.name} has no controller to wire: its inputs are held (table "
            "[inputs]); export its body with `softbody export fmu`"
        )
    if scenario.bodies:
        raise ScenarioError(
            f"scenario {scenario.name} has several bodies, and an SSP cannot add up what they give "
            "the controller; export each with `softbody export fmu --body NAME`"
        )
    body = SoftBodyParticipant(build_body(scenario), inputs=scenario.inputs)
    controller = FmuParticipant(
        controller_path(settings, scenario.folder),
        "controller",
        settings.parameters,
        run_as=settings.isolation.run_as,
    )
    try:
        controller.ports = with_units(controller.ports, settings.ports)
        with errors_with_paths():
            controller.check_step(scenario.coupling.step)
            connections = connect(controller, body.ports, settings.ports)
            Wiring([controller, body], connections)  # refuses units that do not fit
    finally:
        controller.close()
    units = _units_of_body(connections, controller.ports)
    with tempfile.TemporaryDirectory(prefix="softbody-export-") as name:
        body_fmu = Path(name) / "body.fmu"
        platforms = export_fmu(scenario, body_fmu, units)
        bound = bound_parameters(controller.path, settings.parameters)
        fmu = _controller_fmu(settings, scenario.folder, controller.path, bound, Path(name))
        components = [
            Component("controller", fmu, controller.ports, bound),
            Component("body", body_fmu, _with_units(body.ports, units)),
        ]
        stop = scenario.steps * scenario.coupling.step
        write_ssp(path, scenario.title, components, connections, stop)
        return [platform for platform in platforms if platform in platforms_of(fmu)]


def _units_of_body(
    connections: Sequence[Connection], controller: Mapping[str, Port]
) -> dict[str, str]:
    """Unit of each of the body's ports that is connected: that of the controller's port."""
    units: dict[str, str] = {}
    for connection in connections:
        ends = [connection.source.partition("."), connection.target.partition(".")]
        body, other = ends if ends[0][0] == "body" else ends[::-1]
        symbol = _symbol(controller[other[2]])
        if units.setdefault(body[2], symbol) != symbol:
            raise WiringError(
                f"connection {connection}: the controller takes the body's {body[2]} in "
                f"{units[body[2]]!r} too; an SSP that all masters read alike has one unit for it"
            )
    return units


def _symbol(port: Port) -> str:
    if port.unit is None:
        return "1"
    try:
        known = unit(port.unit.symbol)
        port.unit.conversion_to(known)
    except UnitError as error:
        raise WiringError(
            f"port {port.name}: unit {port.unit.symbol!r} is not known; name one in "
            "[controller.ports]"
        ) from error
    return port.unit.symbol


def _with_units(ports: Mapping[str, Port], units: Mapping[str, str]) -> dict[str, Port]:
    return {
        name: replace(port, unit=unit(units[name])) if name in units else port
        for name, port in ports.items()
    }


def _controller_fmu(
    controller: Controller,
    where: Path,
    fmu: Path,
    parameters: Sequence[Assignment],
    folder: Path,
) -> Path:
    """FMU of a controller: that which is there, or one with other start values."""
    if controller.use.endswith(".fmu") or not parameters:
        return fmu
    starts = {assignment.variable.name: assignment.values[0] for assignment in parameters}
    source = controller_source(controller.use, where)
    return build_configured(source, starts, folder / "controller.fmu")
