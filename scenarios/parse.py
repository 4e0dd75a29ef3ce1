"""From TOML text to a scenario."""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomli_w

from cosim import ALGORITHMS
from cosim.controllers import CONTROLLERS
from cosim.fmu.isolation import ISOLATIONS
from cosim.soft_body import body_ports
from scenarios.bodies import members
from scenarios.decode import choose, decode, refuse_unknown, table
from scenarios.errors import ScenarioError
from scenarios.port_names import port_names
from scenarios.schema import (
    Body,
    Controller,
    ControllerValue,
    Coupling,
    Isolation,
    Mesh,
    Obstacle,
    Run,
    Scenario,
)
from softbody_core import (
    CONSTRAINTS,
    FORCES,
    INTEGRATORS,
    Contact,
    Inputs,
    VelocityVerlet,
    Weights,
)
from softbody_core.forces import Law
from softbody_core.integrators import Integrator

_TABLES: Final = [
    "mesh",
    "body",
    "forces",
    "constraints",
    "obstacles",
    "contact",
    "controller",
    "inputs",
    "integrator",
    "coupling",
    "run",
]

_ISOLATION: Final = [field.name for field in dataclasses.fields(Isolation)]
"""Keys of the controller's table that say where it runs; a table of that name has parameters."""

_OBSTACLE: Final = re.compile(r"[a-z][a-z0-9_]*")

_MOST_STEPS: Final = 10_000_000


def parse(
    name: str,
    text: str,
    folder: Path,
    changes: Mapping[str, Any] | None = None,
    variant: str | None = None,
) -> Scenario:
    """Make a scenario of TOML text.

    Parameters
    ----------
    name : str
        For messages and datasets.
    text : str
        TOML.
    folder : Path
        Against which relative paths are read.
    changes : mapping, optional
        Values to put in place first, by dotted path: ``{"forces.alpha": 0.5}``.
    variant : str, optional
        Key in the table ``variants`` whose changes are put in place before those.

    Raises
    ------
    ScenarioError
        With the path of the bad field.
    """
    data = read_toml(name, text)
    variants = variants_of(data)
    data.pop("variants", None)
    chosen = {} if variant is None else choose(variant, variants, "variant")
    for path, value in {**chosen, **(changes or {})}.items():
        _put(data, path, value)
    if chosen or changes:
        text = tomli_w.dumps(data)
    if "bodies" not in data:
        return _scenario(name, data, text, folder)
    bodies = {key: _member(name, own, key, folder) for key, own in members(data, _TABLES).items()}
    return dataclasses.replace(next(iter(bodies.values())), text=text, bodies=bodies)


def _member(name: str, data: dict[str, Any], key: str, folder: Path) -> Scenario:
    """One of several bodies, as a scenario of its own."""
    try:
        return _scenario(name, data, tomli_w.dumps(data), folder)
    except ScenarioError as error:
        raise ScenarioError(f"bodies.{key}: {error}") from error


def _scenario(name: str, data: dict[str, Any], text: str, folder: Path) -> Scenario:
    refuse_unknown(data, ["title", *_TABLES], "")
    for required in ("mesh", "body", "forces", "coupling", "run"):
        if required not in data:
            raise ScenarioError(f"table [{required}] is missing")
    if ("controller" in data) == ("inputs" in data):
        raise ScenarioError(
            "expected a table [controller], or a table [inputs] with the delta_p and n that are "
            f"held; got {'both' if 'inputs' in data else 'neither'}"
        )
    tables = {key: table(data.get(key, {}), key) for key in _TABLES}
    refuse_unknown(tables["constraints"], list(CONSTRAINTS), "constraints")
    weights, forces = _forces(tables["forces"])
    scenario = Scenario(
        name=name,
        title=str(data.get("title", name)),
        mesh=_mesh(tables["mesh"], "mesh"),
        body=decode(Body, tables["body"], "body"),
        weights=weights,
        forces=forces,
        constraints=tuple(
            decode(CONSTRAINTS[key], one, f"constraints.{key}")
            for key, value in tables["constraints"].items()
            for one in (value if isinstance(value, list) else [value])
        ),
        obstacles=tuple(_obstacle(key, value) for key, value in tables["obstacles"].items()),
        contact=_contact(tables["contact"]),
        controller=_controller(tables["controller"]) if "controller" in data else None,
        inputs=decode(Inputs, tables["inputs"], "inputs"),
        integrator=_integrator(tables["integrator"]),
        coupling=_coupling(tables["coupling"]),
        run=decode(Run, tables["run"], "run"),
        text=text,
        folder=folder,
    )
    if scenario.steps > _MOST_STEPS:
        raise ScenarioError(
            f"coupling.step = {scenario.coupling.step:.3g} s makes {scenario.steps:.3g} steps; "
            f"expected at most {_MOST_STEPS:.0e}: take a longer step or fewer cycles"
        )
    wanted = scenario.run.cycles * scenario.run.period
    if not math.isclose(scenario.steps * scenario.coupling.step, wanted, rel_tol=1e-9):
        raise ScenarioError(
            f"coupling.step = {scenario.coupling.step:.6g} s does not divide the run of "
            f"{wanted:.6g} s; choose a whole part of run.period"
        )
    return scenario


def read_toml(name: str, text: str) -> dict[str, Any]:
    """Read TOML text; `name` is for the message."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"scenario {name} is no valid TOML: {error}") from error


def variants_of(data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Tables of changes, by dotted path, that make a family of one scenario."""
    variants = table(data.get("variants", {}), "variants")
    return {key: table(value, f"variants.{key}") for key, value in variants.items()}


def _mesh(data: dict[str, Any], path: str) -> Mesh:
    mesh = decode(Mesh, data, path)
    sources = ("lung", "file", "icosphere", "ball", "glass")
    given = [key for key in sources if getattr(mesh, key) is not None]
    if len(given) != 1:
        raise ScenarioError(
            f"{path}: expected exactly one of {', '.join(sources)}; "
            f"got {', '.join(given) or 'none'}"
        )
    if given[0] in ("icosphere", "ball") and mesh.volume is None:
        raise ScenarioError(f'{path}.volume is missing; a sphere needs text like "2.5 L"')
    return mesh


def _obstacle(name: str, data: object) -> Obstacle:
    path = f"obstacles.{name}"
    values = table(data, path)
    if not _OBSTACLE.fullmatch(name) or f"{name}_x" in body_ports():
        raise ScenarioError(
            f"{path}: expected a name of small letters, digits and underscores that is none of "
            "the body's own variables: those of the obstacle begin with it"
        )
    if "mesh" not in values:
        raise ScenarioError(f"{path}.mesh is missing; expected a table like [mesh]")
    if "name" in values:
        raise ScenarioError(f"{path}.name is unknown; the table's own name is the obstacle's")
    mesh = _mesh(table(values["mesh"], f"{path}.mesh"), f"{path}.mesh")
    return decode(Obstacle, {**values, "name": name, "mesh": mesh}, path)


def _contact(data: dict[str, Any]) -> Contact:
    if "bodies" in data:
        raise ScenarioError(
            "contact.bodies is unknown; give each obstacle a table [obstacles.NAME]"
        )
    return decode(Contact, data, "contact")


def _forces(data: dict[str, Any]) -> tuple[Weights, tuple[Law, ...]]:
    greek = ["alpha", "beta", "gamma", "delta"]
    refuse_unknown(data, [*greek, *FORCES], "forces")
    weights = decode(Weights, {k: v for k, v in data.items() if k in greek}, "forces")
    laws = {key: value for key, value in data.items() if key in FORCES}
    return weights, tuple(
        decode(FORCES[key], value, f"forces.{key}") for key, value in laws.items()
    )


def _controller(data: dict[str, Any]) -> Controller:
    """Read ``use``, and of the tables of parameters the one that bears its name."""
    use = data.get("use")
    if not isinstance(use, str):
        raise ScenarioError(
            f"controller.use = {use!r}: expected a controller's name or an FMU file"
        )
    isolation = _isolation(
        {k: data[k] for k in _ISOLATION if not isinstance(data.get(k, {}), dict)}
    )
    tables = {
        key: table(value, f"controller.{key}")
        for key, value in data.items()
        if key not in ("use", "ports") and (key not in _ISOLATION or isinstance(value, dict))
    }
    own = Controller(use).key
    for key in tables:
        similar = difflib.get_close_matches(key, {own, "ports", *CONTROLLERS}, n=1, cutoff=0.75)
        if similar and key not in {own, *CONTROLLERS}:
            raise ScenarioError(f"controller.{key} is unknown; did you mean {similar[0]!r}?")
    parameters = tables.get(own, {})
    for key, value in parameters.items():
        if not isinstance(value, ControllerValue):
            raise ScenarioError(f"controller.{use}.{key} = {value!r}: expected a single value")
    ports = port_names(data.get("ports", {}))
    return Controller(use, parameters, isolation, ports if use.endswith(".fmu") else {})


def _isolation(data: dict[str, Any]) -> Isolation:
    isolation = decode(Isolation, data, "controller")
    choose(isolation.isolation, ISOLATIONS, "controller.isolation")
    if "time_limit" in data and isolation.isolation == "none":
        raise ScenarioError(
            'controller.time_limit has no effect without controller.isolation = "process"'
        )
    return isolation


def _integrator(data: dict[str, Any]) -> Integrator:
    if not data:
        return VelocityVerlet()
    options = dict(data)
    method = options.pop("method", None)
    return decode(choose(method, INTEGRATORS, "integrator.method"), options, "integrator")


def _coupling(data: dict[str, Any]) -> Coupling:
    """Read the step, and the algorithm with its own options."""
    options = dict(data)
    kind = choose(options.pop("algorithm", "gauss-seidel"), ALGORITHMS, "coupling.algorithm")
    own = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
    refuse_unknown(options, ["step", *own], "coupling")
    step = {"step": options.pop("step")} if "step" in options else {}
    coupling = decode(Coupling, step, "coupling")
    return dataclasses.replace(coupling, algorithm=decode(kind, options, "coupling"))


def _put(data: dict[str, Any], path: str, value: Any) -> None:
    """Set a value at a dotted path, making tables on the way."""
    *parents, last = path.split(".")
    here = data
    for index, key in enumerate(parents):
        here = table(here.setdefault(key, {}), ".".join(parents[: index + 1]))
    here[last] = value.item() if isinstance(value, np.generic) else value  # TOML has no NumPy
