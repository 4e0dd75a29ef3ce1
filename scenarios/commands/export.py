"""The commands ``softbody export``: fmu and ssp."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter
from rich.console import Console

from cosim.export import PLATFORM
from scenarios.commands.options import chosen
from scenarios.export.body import export_fmu
from scenarios.export.system import export_ssp
from scenarios.results.files import check_writable
from scenarios.running.run import with_controller
from scenarios.scene.tables import choose

export_app = App(
    name="export", help="For other co-simulation tools: a scenario's body as an FMU, or all of it."
)

Changes = Annotated[tuple[str, ...], Parameter(name="--set", negative=())]


@export_app.command(name="fmu")
def fmu(
    scenario: str,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    set_: Changes = (),
    body: str | None = None,
    fmi: Literal[2, 3] = 2,
) -> None:
    """Write the body of a scenario as a co-simulation FMU.

    Parameters
    ----------
    scenario
        A name from `softbody list`, or a TOML file.
    output
        The FMU to write.
    set_
        Change a value, such as --set forces.alpha=0.5. May be repeated.
    body
        One of the bodies, by name, where the scenario has several.
    fmi
        Version of FMI.
    """
    check_writable(output, ".fmu")
    scene = chosen(scenario, set_)
    if body is not None:
        scene = choose(body, scene.bodies, "--body")
    _say(output, export_fmu(scene, output, fmi=fmi))


@export_app.command(name="ssp")
def ssp(
    scenario: str,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    controller: str | None = None,
    set_: Changes = (),
) -> None:
    """Write body and controller of a scenario, wired, as an SSP 1.0 archive.

    Parameters
    ----------
    scenario
        A name from `softbody list`, or a TOML file.
    output
        The SSP to write.
    controller
        Another controller: a name from `softbody controller list`, an FMU, or a Python file.
    set_
        Change a value, such as --set forces.alpha=0.5. May be repeated.
    """
    check_writable(output, ".ssp")
    scene = chosen(scenario, set_)
    if controller is not None:
        scene = with_controller(scene, controller)
    _say(output, export_ssp(scene, output))


def _say(output: Path, platforms: list[str]) -> None:
    out = Console()
    where = " and ".join(platforms) or "no platform"
    said = f"wrote {output}; it runs on {where}, where Python finds softbody-cosim"
    out.print(said, highlight=False, soft_wrap=True)
    if PLATFORM not in platforms:
        out.print(f"note: it does not run on this machine ({PLATFORM})", highlight=False)
