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
    no_binary = _why_no_binary_fits(description, folder)
    no_script = _why_no_script_runs(description, folder)
    if wanted is None:
        wanted = "python" if no_binary is not None and no_script is None else "fmu"
    obstacle = no_binary if wanted == "fmu" else no_script
    if obstacle is not None:
        raise FmuError(f"FMU {path} {obstacle}")
    return wanted


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


def _why_no_binary_fits(description: ModelDescription, folder: Path) -> str | None:
    """Why an FMU has no binary for this machine; None if it has one."""
    system = fmpy.platform_tuple if description.fmiVersion.startswith("3.") else fmpy.platform
    identifier = description.coSimulation.modelIdentifier
    name = f"binaries/{system}/{identifier}{fmpy.sharedLibraryExtension}"
    if not (folder / name).is_file():
        others = ", ".join(fmpy.supported_platforms(str(folder))) or "none"
        return f"has no binary for this machine ({name}); it runs on: {others}"
    machine = platform.machine()
    if not _is_for(folder / name, machine):
        return f"has a binary ({name}), but for another processor than this {machine}"
    return None


def _is_for(binary: Path, machine: str) -> bool:
    """Whether a binary is for a processor, as far as an ELF header tells."""
    with binary.open("rb") as file:
        header = file.read(20)
    if header[:4] != b"\x7fELF" or machine not in _ELF_MACHINES:
        return True
    return int.from_bytes(header[18:20], "little") == _ELF_MACHINES[machine]
