"""Can an FMU drive a body? What keeps it from that, and what other tools may mind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import fmpy
from fmpy.model_description import ModelDescription
from fmpy.validation import validate_fmu

from cosim.errors import FmuError
from cosim.fmu.description import read_description
from cosim.fmu.findings import FINDERS, Finding, Subject, numeric_ports
from cosim.fmu.folder import FmuFolder
from cosim.fmu.steps import fixed_step
from cosim.fmu.trial import try_fmu
from cosim.matching import PortName, match, with_units
from cosim.participant import Causality, Port
from cosim.units import UnitError

FRAME: Final = 1 / 30
"""Communication step of the scenarios that ship, s."""

_AT_REST: Final = {"volume": 2.5e-3, "bounding_box_volume": 5e-3}
"""What a lung gives in a trial, SI; 0 for the rest."""


@dataclass(frozen=True)
class PortUse:
    """A port of an FMU and what it connects to.

    Attributes
    ----------
    port : Port
        With the unit that counts.
    partner : Port or None
        The body's port.
    factor, offset : float
        Turn values into the unit of whichever of the two takes them.
    """

    port: Port
    partner: Port | None = None
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Check:
    """What was found of an FMU.

    Attributes
    ----------
    title : str
        FMI version and name of the model, as far as they are known.
    ports : list of PortUse
        Its numeric ports.
    findings : list of Finding
        Faults first.
    """

    title: str
    ports: list[PortUse]
    findings: list[Finding]

    @property
    def ok(self) -> bool:
        """Whether the FMU can drive a body."""
        return not any(finding.fault for finding in self.findings)


def check_fmu(
    path: Path, body: Mapping[str, Port], names: Mapping[str, PortName] | None = None
) -> Check:
    """Look at an FMU, and try it for some steps in a process of its own.

    Parameters
    ----------
    path : Path
        The FMU.
    body : mapping
        Ports of the body that it should drive.
    names : mapping, optional
        By port of the body: its name in the FMU, where that differs.

    Returns
    -------
    Check
        Whatever is wrong with the FMU is in it, and not raised.
    """
    try:
        folder = FmuFolder(path)
    except FmuError as error:
        return Check("", [], [Finding.of(path, error)])
    try:
        return _check(path, folder, body, names or {})
    finally:
        folder.close()


def _check(
    path: Path, folder: FmuFolder, body: Mapping[str, Port], names: Mapping[str, PortName]
) -> Check:
    findings = []
    try:
        description = read_description(path, folder)
    except FmuError as error:
        findings.append(Finding.of(path, error))
        try:
            description = fmpy.read_model_description(str(folder.path), validate=False)
        except Exception:  # it was said above
            return Check("", [], findings)
    title = f"FMI {description.fmiVersion}, {description.modelName}"
    if description.coSimulation is None:
        return Check(title, [], findings)
    subject = Subject(path, folder.path, description, FRAME)
    ports, of_ports = numeric_ports(subject)
    uses, of_uses = _uses(with_units(ports, names), body, names)
    findings += [*of_ports, *of_uses]
    findings += [finding for find in FINDERS for finding in find(subject)]
    findings += _breaths(ports)
    if not any(finding.fault for finding in findings):
        inputs = {
            use.port.name: use.factor * _AT_REST.get(use.partner.name, 0.0) + use.offset
            for use in uses
            if use.partner is not None and use.port.causality is Causality.INPUT
        }
        findings += try_fmu(path, inputs, _trial_step(subject, description))
    findings += [
        Finding(f"fmpy validate: {' '.join(text.split())}") for text in validate_fmu(str(path))
    ]
    unique = list(dict.fromkeys(findings))
    return Check(title, uses, sorted(unique, key=lambda finding: not finding.fault))


def _breaths(ports: Mapping[str, Port]) -> list[Finding]:
    """What is missing to tell breaths apart."""
    if "phase" in ports and ports["phase"].causality is Causality.OUTPUT:
        return []
    return [
        Finding(
            "no output phase (1 inhaling, 0 exhaling): breaths are told apart by the lows of the "
            "volume"
        )
    ]


def _uses(
    ports: Mapping[str, Port], body: Mapping[str, Port], names: Mapping[str, PortName]
) -> tuple[list[PortUse], list[Finding]]:
    """What each port connects to, and what is wrong with that."""
    matching = match(ports, body, names)
    findings = [Finding(f.text, fault=True, settings=f.settings) for f in matching.faults]
    partners = {variable: body[name] for variable, name in matching.pairs}
    uses = []
    for port in ports.values():
        partner = partners.get(port.name)
        factor, offset = 1.0, 0.0
        if partner is not None:
            try:
                factor, offset = _conversion(port, partner)
            except UnitError as error:
                settings = (f"names.{partner.name}",)
                findings.append(Finding(str(error), fault=True, settings=settings))
        uses.append(PortUse(port, partner, factor, offset))
    return uses, findings


def _conversion(port: Port, partner: Port) -> tuple[float, float]:
    cure = f'names.{partner.name} = {{ variable = "{port.name}", unit = "…" }}'
    what = f"{port.causality.value} {port.name}, for the body's {partner.name}"
    given, taken = port.unit, partner.unit
    if given is None or taken is None:
        wanted = "" if taken is None else f"; expected one that converts to {taken.symbol!r}"
        raise UnitError(f"{what}, declares no unit{wanted}. Or give it: {cure}")
    if port.causality is Causality.INPUT:
        given, taken = taken, given
    try:
        return given.conversion_to(taken)
    except UnitError as error:
        raise UnitError(f"{what}: {error}. If its unit is another, give it: {cure}") from error


def _trial_step(subject: Subject, description: ModelDescription) -> float:
    """A frame, or the FMU's own step where it takes no other."""
    fixed = fixed_step(subject.path, description, subject.folder)
    experiment = description.defaultExperiment
    length = description.coSimulation.fixedInternalStepSize or (experiment and experiment.stepSize)
    return FRAME if fixed is None or not length else float(length)
