"""FMUs of FMI 3.0: what pythonfmu3 leaves out of a model description is added here."""

from __future__ import annotations

from typing import Final
from xml.etree import ElementTree as ET

import pythonfmu3

from cosim.controllers.build import Standard
from cosim.controllers.completion import add_units, child, identity, set_flags


def _complete(root: ET.Element, slave: type, content: str) -> None:
    root.set("instantiationToken", identity(content))
    type_node = child(root, "CoSimulation")
    set_flags(type_node, slave, "canGetAndSetFMUState", "canSerializeFMUState")
    type_node.set("canHandleVariableCommunicationStepSize", "true")  # pythonfmu3 mixes this one up
    variables = list(child(root, "ModelVariables"))
    add_units(root, type_node, slave, {str(v.get("name")): v for v in variables})
    parameters = [str(v.get("valueReference")) for v in variables if _is(v, "parameter")]
    structure = child(root, "ModelStructure")
    for unknown in structure.findall("InitialUnknown"):
        structure.remove(unknown)
    for output in structure.findall("Output"):  # which no input reaches within a step
        output.set("dependencies", "")
    for variable in variables:
        if _is(variable, "output"):
            variable.set("initial", "calculated")
            variable.attrib.pop("start", None)
            about = {"valueReference": str(variable.get("valueReference"))}
            about["dependencies"] = " ".join(parameters)
            ET.SubElement(structure, "InitialUnknown", about)


def _is(variable: ET.Element, causality: str) -> bool:
    return variable.get("causality") == causality


FMI3: Final = Standard(
    pythonfmu3.FmuBuilder, pythonfmu3.__version__, pythonfmu3.Fmi3Slave, _complete
)
