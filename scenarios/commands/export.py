"""The commands ``softbody export``: fmu and ssp."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from cyclopts import App

from cosim.export import PLATFORM
from scenarios.commands.options import (
    Changes,
    ControllerName,
    Output,
    ScenarioName,
    build_scenario,
)
from scenarios.commands.terminal import Terminal
from scenarios.export.body import export_fmu
from scenarios.export.system import export_ssp
from scenarios.results.files import check_writable
from scenarios.scene.tables import choose

export_app = App(
    name="export", help="For other co-simulation tools: a scenario's body as an FMU, or all of it."
)


@export_app.command(name="fmu")
def fmu(
    scenario: ScenarioName,
    /,
    *,
    output: Output,
    set_: Changes = (),
    body: str | None = None,
    fmi: Literal[2, 3] = 2,
) -> None:
    """Write the body of a scenario as a co-simulation FMU.

    Parameters
    ----------
    output
        The FMU to write.
    body
        One of the bodies, by name, where the scenario has several.
    fmi
        Version of FMI.
    """
    check_writable(output, ".fmu")
    scene = build_scenario(scenario, set_)
    if body is not None:
        scene = choose(body, scene.bodies, "--body")
    _report(output, export_fmu(scene, output, fmi=fmi))


@export_app.command(name="ssp")
def ssp(
    scenario: ScenarioName,
    /,
    *,
    output: Output,
    controller: ControllerName = None,
    set_: Changes = (),
) -> None:
    """Write body and controller of a scenario, wired, as an SSP 1.0 archive.

    Parameters
    ----------
    output
        The SSP to write.
    """
    check_writable(output, ".ssp")
    scene = build_scenario(scenario, set_, controller=controller)
    _report(output, export_ssp(scene, output))


def _report(output: Path, platforms: list[str]) -> None:
    terminal = Terminal()
    where = " and ".join(platforms) or "no platform"
    terminal.line(f"wrote {output}; it runs on {where}, where Python finds softbody-cosim")
    if PLATFORM not in platforms:
        terminal.line(f"note: it does not run on this machine ({PLATFORM})")
