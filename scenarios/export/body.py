"""A scenario's body as an FMU."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path

from cosim import SoftBodyParticipant, unit
from cosim.controllers import build
from cosim.export import Interface, platforms_of, ports_as_variables, standard
from scenarios.errors import ScenarioError
from scenarios.export.packing import pack, shim
from scenarios.export.parameters import exported_parameters
from scenarios.running.assemble import build_body
from scenarios.scene.scenario import Scenario
from softbody_core import Inputs
from softbody_core.ground.parameters import quantities_of


def export_fmu(
    scenario: Scenario, path: Path, units: Mapping[str, str] | None = None, fmi: int = 2
) -> list[str]:
    """Write a scenario's body as a co-simulation FMU.

    It holds the scenario and its surfaces, and needs this package where it runs.

    Parameters
    ----------
    scenario : Scenario
        Its controller is left out.
    path : Path
        The FMU to write.
    units : mapping, optional
        Units of its ports, by name, in place of SI units.
    fmi : {2, 3}
        Version of FMI.

    Returns
    -------
    list of str
        Platforms that it has binaries for, in FMI's words.

    Raises
    ------
    ScenarioError, MeshError
        If there are several bodies, or the body cannot be built.
    ControllerError
        If FMI 3.0 is asked for and pythonfmu3 is not installed.
    """
    if scenario.bodies:
        raise ScenarioError(
            f"scenario {scenario.name} has several bodies, and an FMU holds one; name it, such "
            f"as --body {next(iter(scenario.bodies))}"
        )
    units = units or {}
    body = SoftBodyParticipant(build_body(scenario), inputs=scenario.inputs)
    starts = {
        name: _converted(value, quantities_of(Inputs)[name].unit, units.get(name))
        for name, value in asdict(scenario.inputs).items()
    }
    bounds = {
        name: quantity.at_least
        for name, quantity in quantities_of(Inputs).items()
        if quantity.at_least is not None
    }
    interface = Interface(
        title=scenario.title,
        version=version("softbody-cosim"),
        step=scenario.coupling.step,
        stop=scenario.steps * scenario.coupling.step,
        variables=(
            *ports_as_variables(body.ports, units, starts, bounds),
            *exported_parameters(scenario),
        ),
    )
    with tempfile.TemporaryDirectory(prefix="softbody-export-") as name:
        folder = Path(name)
        script = folder / "soft_body.py"
        script.write_text(shim(fmi), encoding="utf-8")
        build(script, path, [interface.write(folder), *pack(scenario, folder)], standard(fmi))
    return platforms_of(path)


def _converted(value: float, unit_of_value: str, wanted: str | None) -> float:
    if wanted is None:
        return value
    factor, offset = unit(unit_of_value).conversion_to(unit(wanted))
    return factor * value + offset
