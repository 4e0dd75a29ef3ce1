"""The commands ``softbody controller``: list, new, build and check."""

from __future__ import annotations

from pathlib import Path

from cyclopts import App
from rich.markup import escape
from rich.table import Table

from cosim import Causality, FmuError
from cosim.controllers import (
    CONTROLLERS,
    build,
    controller_fmu,
    controller_source,
    new_source,
)
from cosim.controllers.check import Check, PortUse, check_fmu
from cosim.soft_body import body_ports
from scenarios.commands.options import Output
from scenarios.commands.terminal import Terminal
from scenarios.errors import OutputError
from scenarios.results.files import check_writable, replacing
from scenarios.scene.catalogue import draft
from scenarios.scene.setting_paths import with_paths

controller_app = App(
    name="controller", help="Controllers: list them, start one, build it as an FMU, check an FMU."
)


@controller_app.command(name="list")
def list_() -> None:
    """List the controllers that ship."""
    terminal = Terminal()
    for name in CONTROLLERS:
        description = controller_source(name).read_text(encoding="utf-8").split('"""')[1]
        terminal.line(f"{name:18}{description.splitlines()[0]}")


@controller_app.command(name="new")
def new(name: str, /) -> None:
    """Write the source of a controller that works, to be changed.

    Parameters
    ----------
    name
        Of the controller, such as my_vent; the file is my_vent.py in this folder.
    """
    text = new_source(name)
    path = Path(f"{name}.py")
    if path.exists():
        raise OutputError(f"{path} is there already; choose another name, or remove it first")
    check_writable(path, ".py")
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")
    terminal = Terminal()
    terminal.line(f"wrote {path}, which works as it is. Next:")
    for command in (
        f"controller check {path}",
        f"run sphere-lung --controller {path}",
        f"controller build {path} -o {name}.fmu",
    ):
        terminal.line(f"  softbody {command}")


@controller_app.command(name="build")
def build_(source: str, /, *, output: Output) -> None:
    """Write a controller as an FMU.

    Parameters
    ----------
    source
        A name from `softbody controller list`, or a Python file with a pythonfmu class.
    output
        The FMU to write.
    """
    check_writable(output, ".fmu")
    Terminal().line(f"wrote {build(controller_source(source), output)}")


@controller_app.command(name="check")
def check(fmu: str, /, *, scenario: str | None = None) -> None:
    """Say whether a controller can drive a body, and what is missing.

    Parameters
    ----------
    fmu
        The FMU, a Python file with a pythonfmu class, or a name from `softbody controller list`.
    scenario
        A scenario whose table [controller.ports] says what the FMU's ports are called.
    """
    names = None
    if scenario is not None:
        driven = draft(scenario).with_controller(fmu).build().controller
        names = {} if driven is None else driven.ports
    built = fmu in CONTROLLERS or fmu.endswith(".py")
    path = controller_fmu(fmu) if built else Path(fmu)
    report = check_fmu(path, body_ports(), names)
    _show(Terminal(), fmu, report)
    if not report.ok:
        faults = sum(finding.fault for finding in report.findings)
        raise FmuError(
            f"{fmu} cannot drive a body: {faults} fault{'s' if faults > 1 else ''}, see above"
        )


def _show(terminal: Terminal, fmu: str, report: Check) -> None:
    if report.title:
        terminal.line(f"{fmu}: {report.title}")
    if report.ports:
        table = Table()
        for heading in ("port", "", "unit", "the body's", "conversion"):
            table.add_column(heading)
        for use in report.ports:
            table.add_row(*map(escape, _row(use)))
        terminal.show(table)
    for finding in report.findings:
        text = with_paths(finding.text, finding.settings)
        if finding.fault:
            terminal.line(text, label="fault", style="red")
        else:
            terminal.line(text, label="note")
    if report.ok:
        terminal.line(f"ok: {fmu} can drive a body")


def _row(use: PortUse) -> tuple[str, ...]:
    port, partner = use.port, use.partner
    entry = port.causality is Causality.INPUT
    symbol = "none" if port.unit is None else port.unit.symbol
    if partner is None:
        return port.name, port.causality.value, symbol, "nothing" if entry else "recorded", ""
    arrow = "←" if entry else "→"
    offset = f" + {use.offset:g}" if use.offset else ""
    return port.name, arrow, symbol, partner.name, f"× {use.factor:.6g}{offset}"
