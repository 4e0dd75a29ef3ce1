"""FMUs and their wires as an SSP 1.0 archive: SystemStructure.ssd and the FMUs beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

import fmpy

from cosim.connection import Connection
from cosim.controllers.build import write_archive, xml_bytes
from cosim.controllers.completion import base_unit
from cosim.fmu.description import python_type
from cosim.fmu.parameters import Assignment, Value, checked_parameters
from cosim.participant import Causality, Port
from cosim.units import Unit

_SSP: Final = "http://ssp-standard.org/SSP1/SystemStructure"
_SSD, _SSC, _SSV = f"{{{_SSP}Description}}", f"{{{_SSP}Common}}", f"{{{_SSP}ParameterValues}}"
_TYPES: Final = {float: "Real", int: "Integer", bool: "Boolean", str: "String"}


@dataclass(frozen=True)
class Component:
    """One FMU of a system.

    Attributes
    ----------
    name : str
        Unique within the system.
    fmu : Path
        The file; it is packed.
    ports : mapping
        What may be connected, by name.
    parameters : sequence of Assignment
        Values that its parameters are bound to.
    """

    name: str
    fmu: Path
    ports: Mapping[str, Port]
    parameters: Sequence[Assignment] = ()


def bound_parameters(fmu: Path, parameters: Mapping[str, Value]) -> list[Assignment]:
    """Values of an FMU's parameters, in its own units and types, for a `Component`.

    Raises
    ------
    FmuError
        For an unknown name, or a value that does not fit.
    """
    description = fmpy.read_model_description(str(fmu), validate=False)
    return checked_parameters(fmu, description, parameters)


def write_ssp(
    path: Path,
    title: str,
    components: Sequence[Component],
    connections: Sequence[Connection],
    stop: float,
) -> None:
    """Write a system of FMUs, without connectors of its own.

    Parameters
    ----------
    path : Path
        The file; the system is named after it.
    title : str
        Description of the system.
    components : sequence of Component
        In the order in which a master that steps one after the other should take them.
    connections : sequence of Connection
        Between ports of the same unit: no conversions are written, for not all masters do them.
        An input without one bears no connector: fmpy 0.3.32 would feed it from its neighbour.
    stop : float
        End of the default experiment, s.
    """
    for prefix, space in (("ssd", _SSD), ("ssc", _SSC), ("ssv", _SSV)):
        ET.register_namespace(prefix, space.strip("{}"))
    root = ET.Element(f"{_SSD}SystemStructureDescription", {"version": "1.0", "name": path.stem})
    system = ET.SubElement(root, f"{_SSD}System", {"name": path.stem, "description": title})
    elements = ET.SubElement(system, f"{_SSD}Elements")
    fed = {connection.target for connection in connections}
    elements.extend([_component(component, fed) for component in components])
    wires = ET.SubElement(system, f"{_SSD}Connections")
    for connection in connections:
        start, end = connection.source.partition("."), connection.target.partition(".")
        names = {"startElement": start[0], "startConnector": start[2]}
        names |= {"endElement": end[0], "endConnector": end[2]}
        ET.SubElement(wires, f"{_SSD}Connection", names)
    root.append(_units(components))
    ET.SubElement(root, f"{_SSD}DefaultExperiment", {"startTime": "0.0", "stopTime": repr(stop)})
    files = {f"resources/{c.name}.fmu": c.fmu.read_bytes() for c in components}
    write_archive(path, {"SystemStructure.ssd": xml_bytes(root), **files})


def _component(component: Component, fed: set[str]) -> ET.Element:
    about = {"name": component.name, "type": "application/x-fmu-sharedlibrary"}
    about["source"] = f"resources/{component.name}.fmu"
    element = ET.Element(f"{_SSD}Component", about)
    connectors = ET.SubElement(element, f"{_SSD}Connectors")
    description = fmpy.read_model_description(str(component.fmu), validate=False)
    for variable in description.modelVariables:
        port = component.ports.get(variable.name)
        if port is None or (
            port.causality is Causality.INPUT and f"{component.name}.{port.name}" not in fed
        ):
            continue
        kind = {"name": port.name, "kind": port.causality.value}
        connector = ET.SubElement(connectors, f"{_SSD}Connector", kind)
        type_ = _TYPES[python_type(variable)]
        unit = {"unit": port.unit.symbol} if port.unit is not None and type_ == "Real" else {}
        ET.SubElement(connector, f"{_SSC}{type_}", unit)
    if component.parameters:
        element.append(_bindings(component))
    return element


def _bindings(component: Component) -> ET.Element:
    bindings = ET.Element(f"{_SSD}ParameterBindings")
    binding = ET.SubElement(bindings, f"{_SSD}ParameterBinding")
    values = ET.SubElement(binding, f"{_SSD}ParameterValues")
    named = {"version": "1.0", "name": component.name}
    parameters = ET.SubElement(
        ET.SubElement(values, f"{_SSV}ParameterSet", named), f"{_SSV}Parameters"
    )
    for assignment in component.parameters:
        variable = assignment.variable
        parameter = ET.SubElement(parameters, f"{_SSV}Parameter", {"name": variable.name})
        value = {"value": _text(assignment.values[0])}
        ET.SubElement(parameter, f"{_SSV}{_TYPES[python_type(variable)]}", value)
    return bindings


def _text(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _units(components: Sequence[Component]) -> ET.Element:
    """Define all units that connectors have."""
    used: dict[str, Unit] = {}
    for component in components:
        used |= {p.unit.symbol: p.unit for p in component.ports.values() if p.unit is not None}
    element = ET.Element(f"{_SSD}Units")
    for symbol, unit in sorted(used.items()):
        node = ET.SubElement(element, f"{_SSC}Unit", {"name": symbol})
        ET.SubElement(node, f"{_SSC}BaseUnit", base_unit(unit))
    return element
