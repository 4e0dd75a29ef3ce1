"""What pythonfmu leaves out of a model description: units, bounds, dependencies, an identity."""

from __future__ import annotations

import uuid
from collections.abc import Mapping
from typing import Final
from xml.etree import ElementTree as ET

from cosim.errors import ControllerError
from cosim.units import SI_BASE, Unit, UnitError, unit

_DISPLAY: Final = {"Pa": "cmH2O", "m3": "L", "m3/s": "L/s", "Pa.s/m3": "cmH2O.s/L"}
"""Units in which tools may show values of an SI unit."""


def complete(root: ET.Element, slave: type, content: str) -> None:
    """Complete a description of FMI 2.0, for a class with a hash of its content."""
    root.set("guid", identity(content))
    type_node = child(root, "CoSimulation")
    set_flags(type_node, slave, "canGetAndSetFMUstate", "canSerializeFMUstate")
    variables = {str(v.get("name")): v for v in child(root, "ModelVariables")}
    add_units(root, type_node, slave, {name: v[0] for name, v in variables.items()})
    _complete_structure(root, variables)


def identity(content: str) -> str:
    """GUID or token of an FMU with this hash."""
    return f"{{{uuid.UUID(content[:32])}}}"


def set_flags(type_node: ET.Element, slave: type, *state_flags: str) -> None:
    """Say what the FMU can do, and what it needs."""
    needs_more = bool(getattr(slave, "needs_installation", False))
    type_node.set("needsExecutionTool", str(needs_more).lower())
    for flag in state_flags:
        type_node.set(flag, str(bool(getattr(slave, "complete_state", False))).lower())


def add_units(
    root: ET.Element, type_node: ET.Element, slave: type, numbers: Mapping[str, ET.Element]
) -> None:
    """Write units and bounds at the elements that bear them, by variable, and define the units."""
    units: Mapping[str, str] = getattr(slave, "units", {})
    bounds: Mapping[str, tuple[float | None, float | None]] = getattr(slave, "bounds", {})
    for name in [*units, *bounds]:
        if name not in numbers:
            raise ControllerError(
                f"{slave.__name__} gives a unit or bounds for {name!r}, which is no variable of it"
            )
    for name, symbol in units.items():
        numbers[name].set("unit", symbol)
        if symbol in _DISPLAY:
            numbers[name].set("displayUnit", _DISPLAY[symbol])
    for name, pair in bounds.items():
        for attribute, bound in zip(("min", "max"), pair, strict=True):
            if bound is not None:
                numbers[name].set(attribute, repr(bound))
    if units:
        definitions = ET.Element("UnitDefinitions")
        try:
            definitions.extend([_unit_element(unit(s)) for s in sorted(set(units.values()))])
        except UnitError as error:
            raise ControllerError(f"{slave.__name__}: {error}") from error
        root.insert(list(root).index(type_node) + 1, definitions)


def _complete_structure(root: ET.Element, variables: Mapping[str, ET.Element]) -> None:
    """Outputs that no input reaches directly, and initial values that follow from parameters."""
    parameters = []
    unknowns = []
    for index, variable in enumerate(variables.values(), start=1):
        causality = variable.get("causality")
        if causality == "parameter":
            parameters.append(str(index))
        if causality in ("output", "local"):
            variable.set("initial", "calculated" if causality == "output" else "exact")
            if causality == "output":
                variable[0].attrib.pop("start", None)
                unknowns.append(str(index))
            elif "start" not in variable[0].attrib:
                variable[0].set("start", "0")
    structure = child(root, "ModelStructure")
    for output in structure.iter("Unknown"):
        output.set("dependencies", "")
    initial = ET.SubElement(structure, "InitialUnknowns")
    for index_text in unknowns:
        ET.SubElement(
            initial, "Unknown", {"index": index_text, "dependencies": " ".join(parameters)}
        )


def _unit_element(definition: Unit) -> ET.Element:
    element = ET.Element("Unit", {"name": definition.symbol})
    ET.SubElement(element, "BaseUnit", base_unit(definition))
    if definition.symbol in _DISPLAY:
        shown = _DISPLAY[definition.symbol]
        factor, _ = definition.conversion_to(unit(shown))
        ET.SubElement(element, "DisplayUnit", {"name": shown, "factor": repr(factor)})
    return element


def base_unit(definition: Unit) -> dict[str, str]:
    """Attributes of a BaseUnit, in FMI and in SSP."""
    powers = dict(definition.dimension)
    base = {si: str(powers[name]) for si, name in SI_BASE.items() if name in powers}
    if definition.factor != 1.0:
        base["factor"] = repr(definition.factor)
    if definition.offset != 0.0:
        base["offset"] = repr(definition.offset)
    return base


def child(root: ET.Element, tag: str) -> ET.Element:
    """Part of a model description that has to be there."""
    part = root.find(tag)
    if part is None:
        raise ControllerError(f"the built FMU has no {tag}; is pythonfmu as expected?")
    return part
