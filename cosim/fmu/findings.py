"""What can be found in an FMU's description and folder: faults, and notes for other tools.

A new one is a function here and its name in `FINDERS`. `fmpy validate` sees none of them.
"""

from __future__ import annotations

import copy
import math
import re
import sys
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import fmpy
from fmpy.model_description import ModelDescription, ModelVariable

from cosim.errors import FmuError, FmuStepError
from cosim.fmu.description import NUMBERS, declared_units, ports_of
from cosim.fmu.run_as import choose_run_as
from cosim.fmu.steps import fixed_step
from cosim.participant import Port

_IDENTIFIER: Final = re.compile(r"[A-Za-z_]\w*", re.ASCII)


@dataclass(frozen=True)
class Finding:
    """Something about an FMU, in plain words.

    Attributes
    ----------
    text : str
        What, and what to do about it.
    fault : bool
        True if it keeps the FMU from being coupled; False for a note.
    settings : tuple of str
        As of `cosim.errors.CosimError`.
    """

    text: str
    fault: bool = False
    settings: tuple[str, ...] = ()

    @classmethod
    def of(cls, path: Path, error: FmuError, *, fault: bool = True) -> Finding:
        """Make one of an error, without the FMU's path, which stands above the findings."""
        return cls(message_of(path, error), fault, error.settings)


@dataclass(frozen=True)
class Subject:
    """An FMU that is looked at.

    Attributes
    ----------
    path, folder : Path
        Its file, and the folder it is unpacked in.
    description : ModelDescription
        What it says of itself.
    step : float
        Communication step that it should take, s.
    """

    path: Path
    folder: Path
    description: ModelDescription
    step: float

    def only(self, variable: ModelVariable) -> ModelDescription:
        """Return the description with one variable, so that each is judged by itself."""
        alone = copy.copy(self.description)
        alone.modelVariables = [variable]
        return alone


def message_of(path: Path, error: FmuError) -> str:
    """Text of an error without the FMU's path."""
    return str(error).removeprefix(f"FMU {path}").lstrip(": ").removeprefix(f"{path} ")


def numeric_ports(subject: Subject) -> tuple[dict[str, Port], list[Finding]]:
    """Ports that can be connected, and what is wrong with the others."""
    ports: dict[str, Port] = {}
    findings = []
    for variable in subject.description.modelVariables:
        if variable.causality not in ("input", "output"):
            continue
        if variable.type not in NUMBERS:
            findings.append(
                Finding(
                    f"{variable.causality} {variable.name} is a {variable.type}, so it connects to "
                    "nothing; an input keeps its start value"
                )
            )
            continue
        try:
            ports |= ports_of(subject.path, subject.only(variable))
        except FmuError as error:
            findings.append(Finding.of(subject.path, error))
    return ports, findings


def _units(subject: Subject) -> Iterator[Finding]:
    """Units of what is no port: their BaseUnit may contradict their name."""
    for variable in subject.description.modelVariables:
        if variable.causality not in ("input", "output"):
            try:
                declared_units(subject.path, subject.only(variable))
            except FmuError as error:
                yield Finding.of(subject.path, error)


def _base_units(subject: Subject) -> Iterator[Finding]:
    bare = [unit.name for unit in subject.description.unitDefinitions if unit.baseUnit is None]
    if bare:
        yield Finding(
            f"{_listed('unit', bare)} without a BaseUnit: other tools cannot convert what has it"
        )


def _start_values(subject: Subject) -> Iterator[Finding]:
    for variable in subject.description.modelVariables:
        if variable.type not in NUMBERS or variable.type == "Boolean":
            continue
        declared = variable.declaredType
        low, high = (
            bound if bound is not None else getattr(declared, name, None)
            for name, bound in (("min", variable.min), ("max", variable.max))
        )
        try:
            lowest = -math.inf if low is None else float(low)
            highest = math.inf if high is None else float(high)
            starts = [float(value) for value in str(variable.start or "").split()]
        except ValueError:
            yield Finding(
                f"{variable.name}: start = {variable.start!r}, min = {low!r}, max = {high!r}: "
                "expected numbers",
                fault=True,
            )
            continue
        if lowest > highest:
            yield Finding(f"{variable.name}: min = {low} is above max = {high}", fault=True)
        for start in starts:
            if not lowest <= start <= highest:
                yield Finding(
                    f"{variable.name}: start = {start:g} is outside its own bounds, "
                    f"{lowest:g} to {highest:g}; correct one of them",
                    fault=True,
                )


def _identity(subject: Subject) -> Iterator[Finding]:
    identifier = subject.description.coSimulation.modelIdentifier or ""
    if not _IDENTIFIER.fullmatch(identifier):
        yield Finding(f"modelIdentifier = {identifier!r}: FMI asks for a C identifier")
    if not subject.description.instantiationToken:
        yield Finding("no GUID (instantiationToken): a binary may refuse to start without its own")
    others = [
        file.stem
        for folder in sorted((subject.folder / "binaries").glob("*"))
        if folder.name in (fmpy.platform, fmpy.platform_tuple)
        for file in folder.glob(f"*{fmpy.sharedLibraryExtension}")
    ]
    if others and identifier not in others:
        yield Finding(
            f"modelIdentifier = {identifier!r}, but the binary for this machine is named "
            f"{', '.join(sorted(others))}; they have to be the same",
            fault=True,
        )


def _machine(subject: Subject) -> Iterator[Finding]:
    try:
        run_as = choose_run_as(subject.path, subject.description, subject.folder, None)
    except FmuError as error:
        yield Finding.of(subject.path, error)
        return
    if run_as == "python":
        yield Finding("has no binary for this machine, so its script is run as Python")


def _capabilities(subject: Subject) -> Iterator[Finding]:
    about = subject.description.coSimulation
    if about.needsExecutionTool:
        yield Finding(
            "needsExecutionTool = true: some tools refuse that; set it to false if it "
            "runs without the tool that made it"
        )
    try:
        fixed = fixed_step(subject.path, subject.description, subject.folder)
    except FmuError as error:
        yield Finding.of(subject.path, error)
        return
    try:
        if fixed is not None:
            yield Finding(
                "cannot vary its step (its flag says so), so the communication step has to be its "
                "own step or a multiple",
                settings=("communication step",),
            )
            fixed.parts(subject.step)
    except FmuStepError as error:
        yield Finding.of(subject.path, error, fault=False)
    if not about.canGetAndSetFMUstate:
        yield Finding(
            "cannot save and restore its state (canGetAndSetFMUstate = false): no "
            "iterated coupling and no checkpoints with it"
        )


def _default_step(subject: Subject) -> Iterator[Finding]:
    experiment = subject.description.defaultExperiment
    if experiment is None or experiment.stepSize is None:
        yield Finding(
            "DefaultExperiment has no stepSize: nobody can tell which step it is made for"
        )


def _python_script(subject: Subject) -> Iterator[Finding]:
    with zipfile.ZipFile(subject.path) as archive:
        if "resources/slavemodule.txt" not in archive.namelist():
            return
        stem = archive.read("resources/slavemodule.txt").decode("utf-8", "replace").strip()
    if stem in sys.stdlib_module_names:
        yield Finding(
            f"its Python script {stem}.py has the name of a standard module: other tools "
            "may run that instead, or crash; rename it"
        )


FINDERS: Final[list[Callable[[Subject], Iterator[Finding]]]] = [
    _identity,
    _machine,
    _units,
    _start_values,
    _base_units,
    _capabilities,
    _default_step,
    _python_script,
]
"""What is looked for, once an FMU has a description with a co-simulation."""


def _listed(word: str, names: list[str]) -> str:
    return f"{word}{'s' if len(names) > 1 else ''} {', '.join(sorted(names))}"
