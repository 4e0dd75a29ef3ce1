"""What an FMU can be run as on this machine: its binary, or the Python script behind it."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Final, Literal

import fmpy
from fmpy.model_description import ModelDescription

from cosim.errors import FmuError
from cosim.fmu.python_slave import SCRIPT_NAME

RunAs = Literal["fmu", "python"]

_ELF_MACHINES: Final = {"x86_64": 0x3E, "aarch64": 0xB7}
"""Where FMI 2.0 has one folder for all processors, a binary itself says which one it is for."""


def choose_run_as(
    path: Path, description: ModelDescription, folder: Path, wanted: RunAs | None
) -> RunAs:
    """Check that an FMU can be run as it should; by default, its binary if one fits.

    Parameters
    ----------
    path, folder : Path
        The FMU, for messages, and where it is unpacked.
    description : ModelDescription
        What it says of itself.
    wanted : {"fmu", "python"}, optional
        As what to run it.

    Raises
    ------
    FmuError
        If it has no binary for this machine, or no script of FMI 2.0.
    """
    binary, libraries = _expected(description, folder), _libraries(description, folder)
    no_script = _why_no_script_runs(description, folder)
    if wanted is None:
        wanted = "python" if not libraries and no_script is None else "fmu"
    if wanted == "python" and no_script is not None:
        raise FmuError(f"FMU {path} {no_script}")
    if wanted == "fmu" and binary not in libraries:
        others = ", ".join(fmpy.supported_platforms(str(folder))) or "none"
        processor = f", for its processor {platform.machine()}" if binary.is_file() else ""
        raise FmuError(
            f"FMU {path} has no binary for this machine ({binary.relative_to(folder)}{processor}); "
            f"it runs on: {others}"
        )
    return wanted


def _expected(description: ModelDescription, folder: Path) -> Path:
    """Binary that FMI asks for on this machine."""
    system: str = fmpy.platform_tuple if description.fmiVersion.startswith("3.") else fmpy.platform
    identifier = description.coSimulation.modelIdentifier
    name = f"{identifier}{fmpy.sharedLibraryExtension}"
    return folder / "binaries" / system / name


def _libraries(description: ModelDescription, folder: Path) -> list[Path]:
    """Binaries for this machine, whatever their name."""
    beside = _expected(description, folder).parent.glob(f"*{fmpy.sharedLibraryExtension}")
    return [library for library in beside if _is_for(library, platform.machine())]


def _why_no_script_runs(description: ModelDescription, folder: Path) -> str | None:
    """Why an FMU cannot be run as Python; None if it can."""
    if not (folder / "resources" / SCRIPT_NAME).is_file():
        return (
            f"holds no Python script (resources/{SCRIPT_NAME}), so it cannot be run as Python; "
            'run it as "fmu"'
        )
    if not description.fmiVersion.startswith("2."):
        return (
            f"is of FMI {description.fmiVersion}, and only scripts of FMI 2.0 (pythonfmu) can be "
            'run as Python; run it as "fmu"'
        )
    return None


def _is_for(binary: Path, machine: str) -> bool:
    """Whether a binary is for a processor, as far as an ELF header tells."""
    with binary.open("rb") as file:
        header = file.read(20)
    if header[:4] != b"\x7fELF" or machine not in _ELF_MACHINES:
        return True
    return int.from_bytes(header[18:20], "little") == _ELF_MACHINES[machine]
