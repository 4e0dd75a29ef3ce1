"""From a controller's Python source to an FMU that other tools accept too.

pythonfmu packs the script with a binary; what it leaves out of the model description is added here:
units, bounds, InitialUnknowns, dependencies, and an identity that follows from the content, so
that the same source always gives the same bytes.
"""

from __future__ import annotations

import hashlib
import importlib
import inspect
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree as ET

import pythonfmu
from fmpy.validation import validate_fmu
from pythonfmu import FmuBuilder

from cosim import units as unit_module
from cosim.controllers import completion
from cosim.controllers.standalone import standalone
from cosim.errors import ControllerError
from cosim.fmu.imports import imports_undone
from cosim.fmu.python_slave import slave_class

_EPOCH: Final = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class Standard:
    """How FMUs of one version of FMI are made.

    Attributes
    ----------
    builder : type
        Packs a script, as ``pythonfmu.FmuBuilder`` does.
    version : str
        Of the package that it comes from.
    base : type
        What the class in the script derives from.
    complete : callable
        Completes a model description, for a class with a hash of its content.
    """

    builder: Any
    version: str
    base: type
    complete: Callable[[ET.Element, type, str], None]


def build(
    source: Path,
    destination: Path,
    resources: Sequence[Path] = (),
    standard: Standard | None = None,
) -> Path:
    """Build a co-simulation FMU from a pythonfmu script.

    A script that imports from `cosim.controllers.frame` gets the text of that file in the place of
    the import; any other is packed as it is.

    The class in the script may carry more attributes: ``units`` (variable → unit), ``bounds``
    (variable → (min, max)), ``complete_state`` (True if all its state is in registered variables,
    or it saves the rest itself, so that the FMU may promise to save and restore it) and
    ``needs_installation`` (True if it runs only where more than Python is installed). Its outputs
    are taken to change in ``do_step`` only.

    Parameters
    ----------
    source : Path
        A Python file with one subclass of ``pythonfmu.Fmi2Slave``.
    destination : Path
        The FMU to write.
    resources : sequence of Path
        Files that the script finds beside itself, of different names.
    standard : Standard, optional
        FMI 2.0 by default.

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
    standard = standard if standard is not None else FMI2
    content = content_hash(source, resources, standard)
    stem = f"{source.stem}_{content[:16]}"
    with tempfile.TemporaryDirectory(prefix="softbody-build-") as name:
        script = Path(name) / f"{stem}.py"
        script.write_bytes(standalone(source))
        beside = [Path(shutil.copy(path, name)) for path in resources]
        with imports_undone(Path(name)):
            sys.path.insert(0, name)
            try:
                packed = standard.builder.build_FMU(
                    script, dest=Path(name) / "fmu", project_files=beside
                )
                slave = slave_class(importlib.import_module(stem), standard.base)
            except Exception as error:  # whatever the script raises
                raise ControllerError(
                    f"controller source {source} cannot be built: {type(error).__name__}: {error}"
                ) from error
        finished = Path(name) / "finished.fmu"
        _finish(Path(packed), finished, slave, content, standard)
        problems = validate_fmu(str(finished))
        if problems:
            raise ControllerError(
                f"controller source {source} makes an FMU that breaks the FMI rules: "
                + "; ".join(problems)
            )
        destination.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(finished, destination)
    return destination


def content_hash(
    source: Path, resources: Sequence[Path] = (), standard: Standard | None = None
) -> str:
    """Hash of everything that decides what `build` writes."""
    standard = standard if standard is not None else FMI2
    digest = hashlib.sha256()
    writers = (build, completion, standard.complete, unit_module)
    makers = (*resources, *(Path(inspect.getfile(writer)) for writer in writers))
    files = (path.read_bytes() for path in makers)
    for part in (standalone(source), *files, standard.version.encode()):
        digest.update(hashlib.sha256(part).digest())
    return digest.hexdigest()


def _finish(packed: Path, finished: Path, slave: type, content: str, standard: Standard) -> None:
    """Copy an FMU with its model description completed, in a fixed order and with a fixed date."""
    with zipfile.ZipFile(packed) as old:
        files = {name: old.read(name) for name in old.namelist()}
    root = ET.fromstring(files["modelDescription.xml"])
    root.attrib.pop("generationDateAndTime", None)
    standard.complete(root, slave, content)
    files["modelDescription.xml"] = xml_bytes(root)
    write_archive(finished, files)


def write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write a zip file that depends on nothing but its content, by name."""
    with zipfile.ZipFile(path, "w") as archive:
        for name in sorted(files):
            info = zipfile.ZipInfo(name, _EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, files[name])


def xml_bytes(root: ET.Element) -> bytes:
    """XML as the text of a file."""
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text


FMI2: Final = Standard(FmuBuilder, pythonfmu.__version__, pythonfmu.Fmi2Slave, completion.complete)
