"""The numbers of a scenario that an exported body lets its host change."""

from __future__ import annotations

import inspect
import math
import re
import sys
from dataclasses import is_dataclass
from typing import Any, Final

from cosim.export import Variable
from scenarios.scene.scenario import Scenario
from softbody_core import INTEGRATORS, Weights
from softbody_core.ground.parameters import Quantity, quantities_of
from softbody_core.weights import Control

_OF_THE_BODY: Final = re.compile(
    r"(mesh|body|forces|contact|integrator)|(forces|constraints|obstacles)\.[^.]+"
)
"""Paths of the tables whose numbers decide how a body moves."""

_LEAST: Final = sys.float_info.min
"""Stands for "more than 0": the bounds of FMI are bounds that a value may reach."""


def exported_parameters(scenario: Scenario) -> list[Variable]:
    """Every single number with a unit that decides how the scenario's body moves.

    Each bears the path by which ``--set`` changes it, such as ``forces.mass_spring.stiffness``.
    """
    return [
        _variable(
            f"{path}.{name}", getattr(owner, name), quantity, _description_of(type(owner), name)
        )
        for path, owner in _parts(scenario).items()
        for name, quantity in quantities_of(type(owner)).items()
        if isinstance(getattr(owner, name), float | int)
    ]


def integrator_name(scenario: Scenario) -> str:
    """Name of the scenario's integrator."""
    return next(key for key, kind in INTEGRATORS.items() if kind is type(scenario.integrator))


def _parts(scenario: Scenario) -> dict[str, Any]:
    """Objects that make the body and what is around it, by the path of their table."""
    return {path: part for path, part in scenario.parts() if _OF_THE_BODY.fullmatch(path)}


def _variable(path: str, value: float | int, quantity: Quantity, description: str) -> Variable:
    lowest, highest = quantity.at_least, None
    if quantity.above is not None:
        lowest = _LEAST if quantity.above == 0 else math.nextafter(quantity.above, math.inf)
    if quantity.below is not None:
        highest = math.nextafter(quantity.below, -math.inf)
    if isinstance(value, int):
        lowest = None if lowest is None else math.ceil(lowest)
        return Variable(path, "parameter", description, None, value, lowest, highest)
    unit = quantity.unit.replace("^", "")
    return Variable(path, "parameter", description, unit, value, lowest, highest)


def _description_of(owner: type[Any], name: str) -> str:
    """First sentence of what the class, or one that it derives from, says of a field."""
    if owner is Weights:
        return f"weight of {Control(name).name.lower()} control"
    texts = [inspect.getdoc(kind) or "" for kind in owner.__mro__ if is_dataclass(kind)]
    entry = rf"^{name} : .*\n((?:    .*\n?)+)"
    entries = (re.search(entry, text, re.MULTILINE) for text in texts)
    description = next(
        (match[1] for match in entries if match is not None), texts[0].partition("\n\n")[0]
    )
    return re.split(r"\.(?: |$)", " ".join(description.split()))[0]
