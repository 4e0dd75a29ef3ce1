"""From a controller's Python source to an FMU that other tools accept too.

pythonfmu packs the script with a binary; what it leaves out of the model description is added here:
units, bounds, InitialUnknowns, dependencies, and an identity that follows from the content, so
that the same source always gives the same bytes.
"""

from __future__ import annotations

import hashlib
import importlib
import shutil
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import pythonfmu
from fmpy.validation import validate_fmu
from pythonfmu import FmuBuilder

from cosim import units as unit_module
from cosim.errors import ControllerError
from cosim.units import SI_BASE, Unit, UnitError, unit

_EPOCH: Final = (1980, 1, 1, 0, 0, 0)


def build(source: Path, destination: Path) -> Path:
    """Build an FMI 2.0 co-simulation FMU from a pythonfmu script.

    The class in the script may carry three more attributes: ``units`` (variable → unit),
    ``bounds`` (variable → (min, max)) and ``complete_state`` (True if all its state is
    in registered variables, so that the FMU may promise to save and restore it). Its outputs are
    taken to change in ``do_step`` only.

    Parameters
    ----------
    source : Path
        A Python file with one subclass of ``pythonfmu.Fmi2Slave``.
    destination : Path
        The FMU to write.

    Returns
    -------
    Path
        `destination`.

    Raises
    ------
    ControllerError
        If the source does not exist, fails, or names unknown units or variables.
    """
    if not source.is_file():
        raise ControllerError(f"controller source {source} does not exist; check the path")
    stem = f"{source.stem}_{content_hash(source)[:16]}"
    with tempfile.TemporaryDirectory(prefix="softbody-build-") as name:
        script = Path(name) / f"{stem}.py"
        shutil.copyfile(source, script)
        with _clean_imports(stem):
            try:
                packed = FmuBuilder.build_FMU(script, dest=Path(name) / "fmu")
                slave = _slave_class(importlib.import_module(stem))
            except Exception as error:  # whatever the script raises
                raise ControllerError(
                    f"controller source {source} cannot be built: {type(error).__name__}: {error}"
                ) from error
        finished = Path(name) / "finished.fmu"
        _finish(Path(packed), finished, slave, content_hash(source))
        problems = validate_fmu(str(finished))
        if problems:
            raise ControllerError(
                f"controller source {source} makes an FMU that breaks the FMI rules: "
                + "; ".join(problems)
            )
        destination.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(finished, destination)
    return destination


def content_hash(source: Path) -> str:
    """Hash of everything that decides what `build` writes."""
    digest = hashlib.sha256()
    makers = (source, Path(__file__), Path(unit_module.__file__))
    for part in (*(path.read_bytes() for path in makers), pythonfmu.__version__.encode()):
        digest.update(hashlib.sha256(part).digest())
    return digest.hexdigest()


@contextmanager
def _clean_imports(stem: str) -> Iterator[None]:
    """Undo what the builder leaves behind in ``sys``."""
    path = list(sys.path)
    try:
        yield
    finally:
        sys.path[:] = path
        sys.modules.pop(stem, None)


def _slave_class(module: Any) -> type:
    classes = [
        item
        for item in vars(module).values()
        if isinstance(item, type)
        and issubclass(item, pythonfmu.Fmi2Slave)
        and item.__module__ == module.__name__
    ]
    return max(classes, key=lambda item: len(item.__mro__))


def _finish(packed: Path, finished: Path, slave: type, content: str) -> None:
    """Copy an FMU with its model description completed, in a fixed order and with a fixed date."""
    with zipfile.ZipFile(packed) as old, zipfile.ZipFile(finished, "w") as new:
        for name in sorted(old.namelist()):
            data = old.read(name)
            if name == "modelDescription.xml":
                root = ET.fromstring(data)
                _complete(root, slave, content)
                ET.indent(root)
                data = ET.tostring(root, encoding="UTF-8", xml_declaration=True)
            info = zipfile.ZipInfo(name, _EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(info, data)


def _complete(root: ET.Element, slave: type, content: str) -> None:
    root.set("guid", f"{{{uuid.UUID(content[:32])}}}")
    root.attrib.pop("generationDateAndTime", None)
    type_node = _child(root, "CoSimulation")
    type_node.set("needsExecutionTool", "false")
    keeps_state = str(bool(getattr(slave, "complete_state", False))).lower()
    type_node.set("canGetAndSetFMUstate", keeps_state)
    type_node.set("canSerializeFMUstate", keeps_state)
    variables = {str(v.get("name")): v for v in _child(root, "ModelVariables")}
    units: Mapping[str, str] = getattr(slave, "units", {})
    bounds: Mapping[str, tuple[float | None, float | None]] = getattr(slave, "bounds", {})
    for name in [*units, *bounds]:
        if name not in variables:
            raise ControllerError(
                f"{slave.__name__} gives a unit or bounds for {name!r}, which is no variable of it"
            )
    for name, symbol in units.items():
        variables[name][0].set("unit", symbol)
    for name, pair in bounds.items():
        for attribute, bound in zip(("min", "max"), pair, strict=True):
            if bound is not None:
                variables[name][0].set(attribute, repr(bound))
    if units:
        definitions = ET.Element("UnitDefinitions")
        try:
            definitions.extend([_unit_element(unit(s)) for s in sorted(set(units.values()))])
        except UnitError as error:
            raise ControllerError(f"{slave.__name__}: {error}") from error
        root.insert(list(root).index(type_node) + 1, definitions)
    _complete_structure(root, variables)


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
    structure = _child(root, "ModelStructure")
    for output in structure.iter("Unknown"):
        output.set("dependencies", "")
    initial = ET.SubElement(structure, "InitialUnknowns")
    for index_text in unknowns:
        ET.SubElement(
            initial, "Unknown", {"index": index_text, "dependencies": " ".join(parameters)}
        )


def _unit_element(definition: Unit) -> ET.Element:
    element = ET.Element("Unit", {"name": definition.symbol})
    powers = dict(definition.dimension)
    base = {si: str(powers[name]) for si, name in SI_BASE.items() if name in powers}
    if definition.factor != 1.0:
        base["factor"] = repr(definition.factor)
    if definition.offset != 0.0:
        base["offset"] = repr(definition.offset)
    ET.SubElement(element, "BaseUnit", base)
    return element


def _child(root: ET.Element, tag: str) -> ET.Element:
    child = root.find(tag)
    if child is None:
        raise ControllerError(f"the built FMU has no {tag}; is pythonfmu as expected?")
    return child
