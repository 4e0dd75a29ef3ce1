"""The table ``[controller.ports]``: what a body's ports are called in an FMU."""

from __future__ import annotations

from typing import Any

from cosim import UnitError, unit
from cosim.matching import PortName
from cosim.soft_body import body_ports
from scenarios.errors import ScenarioError
from scenarios.scene.decode import decode, refuse_unknown, table


def port_names(data: object) -> dict[str, PortName]:
    """Read the table.

    Parameters
    ----------
    data : object
        By port of the body: the FMU's variable, or a table of ``variable`` and ``unit``.

    Raises
    ------
    ScenarioError
        For a port that no body has, or a unit that is unknown or does not convert.
    """
    named = table(data, "controller.ports")
    refuse_unknown(named, list(body_ports()), "controller.ports")
    return {own: _port_name(own, value) for own, value in named.items()}


def _port_name(own: str, value: Any) -> PortName:
    path = f"controller.ports.{own}"
    if not isinstance(value, str | dict):
        raise ScenarioError(
            f'{path} = {value!r}: expected a name, or {{ variable = "…", unit = "…" }}'
        )
    name = decode(PortName, {"variable": value} if isinstance(value, str) else value, path)
    wanted = body_ports()[own].unit
    if name.unit is not None and wanted is not None:
        try:
            unit(name.unit).conversion_to(wanted)
        except UnitError as error:
            raise ScenarioError(f"{path}.unit = {name.unit!r}: {error}") from error
    return name
