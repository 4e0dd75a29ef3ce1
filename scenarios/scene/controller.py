"""The table ``[controller]``: what drives a body, and what the body's ports are called there."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Final

from cosim import UnitError, unit
from cosim.controllers import CONTROLLERS
from cosim.fmu.isolation import ISOLATIONS, TIME_LIMIT
from cosim.fmu.run_as import RunAs
from cosim.matching import PortName
from cosim.soft_body import body_ports
from scenarios.errors import ScenarioError
from scenarios.scene.layout import Decode, In
from scenarios.scene.tables import choose, refuse_unknown, table
from softbody_core.ground.parameters import Parameters, Quantity

ControllerValue = float | int | bool | str


@dataclass(frozen=True)
class Isolation(Parameters):
    """Where a controller runs, and as what.

    Parameters
    ----------
    run_as : {"fmu", "python"}, optional
        "python" runs the script of a Python FMU without its binary; by default, the FMU where its
        binary fits the machine.
    isolation : str
        "none" for this process, "process" for one of its own.
    time_limit : float
        In its own process, how long it may take to answer one call, s.
    """

    run_as: RunAs | None = None
    isolation: str = "none"
    time_limit: Annotated[float, Quantity("s", above=0)] = TIME_LIMIT


_ISOLATION: Final = [field.name for field in dataclasses.fields(Isolation)]
"""Keys of the controller's table that say where it runs; a table of that name has parameters."""


@dataclass(frozen=True)
class Controller:
    """What drives the body.

    Attributes
    ----------
    use : str
        A controller that ships, an FMU, or a Python file with a pythonfmu class.
    parameters : mapping
        What its parameters are set to.
    isolation : Isolation
        Where it runs.
    ports : mapping
        By port of the body, its name in the FMU, where that differs.
    """

    use: str
    parameters: Mapping[str, ControllerValue] = field(default_factory=dict)
    isolation: Annotated[Isolation, In("")] = Isolation()
    ports: Mapping[str, PortName] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Name of the table of its parameters: its own name, or that of its file."""
        return Path(self.use).stem if self.is_file else self.use

    @property
    def is_file(self) -> bool:
        """Whether it is named by its file."""
        return self.use.endswith((".fmu", ".py"))


def read_controller(data: Any, path: str, decode: Decode) -> Controller:
    """Read ``use``, and of the tables of parameters the one that bears its name.

    Raises
    ------
    ScenarioError
        If a value does not fit, or a table's name is nearly that of a controller.
    """
    use = table(data, path).get("use")
    if not isinstance(use, str):
        raise ScenarioError(
            f"{path}.use = {use!r}: expected a controller's name, an FMU (.fmu) or a source (.py)"
        )
    isolation = {k: data[k] for k in _ISOLATION if not isinstance(data.get(k, {}), dict)}
    tables = {
        key: table(value, f"{path}.{key}")
        for key, value in data.items()
        if key not in ("use", "ports", *isolation)
    }
    named = Controller(use).key
    for key in tables:
        similar = difflib.get_close_matches(key, {named, "ports", *CONTROLLERS}, n=1, cutoff=0.75)
        if similar and key not in {named, *CONTROLLERS}:
            raise ScenarioError(f"{path}.{key} is unknown; did you mean {similar[0]!r}?")
    parameters = tables.get(named, {})
    for key, value in parameters.items():
        if not isinstance(value, ControllerValue):
            raise ScenarioError(f"{path}.{use}.{key} = {value!r}: expected a single value")
    ports = _read_ports(data.get("ports", {}), f"{path}.ports", decode)
    return Controller(
        use,
        parameters,
        _read_isolation(isolation, path, decode),
        ports if Controller(use).is_file else {},
    )


def _read_isolation(data: Mapping[str, Any], path: str, decode: Decode) -> Isolation:
    isolation: Isolation = decode(Isolation, data, path)
    choose(isolation.isolation, ISOLATIONS, f"{path}.isolation")
    if "time_limit" in data and isolation.isolation == "none":
        raise ScenarioError(f'{path}.time_limit has no effect without {path}.isolation = "process"')
    return isolation


def _read_ports(data: object, path: str, decode: Decode) -> dict[str, PortName]:
    """Read, by port of the body, the FMU's variable, or a table of ``variable`` and ``unit``."""
    refuse_unknown(table(data, path), body_ports(), path)
    return {
        port: _read_port(port, value, f"{path}.{port}", decode)
        for port, value in table(data, path).items()
    }


def _read_port(port: str, value: Any, path: str, decode: Decode) -> PortName:
    if not isinstance(value, str | dict):
        raise ScenarioError(
            f'{path} = {value!r}: expected a name, or {{ variable = "…", unit = "…" }}'
        )
    data = {"variable": value} if isinstance(value, str) else value
    name: PortName = decode(PortName, data, path)
    wanted = body_ports()[port].unit
    if name.unit is not None and wanted is not None:
        try:
            unit(name.unit).conversion_to(wanted)
        except UnitError as error:
            raise ScenarioError(f"{path}.unit = {name.unit!r}: {error}") from error
    return name
