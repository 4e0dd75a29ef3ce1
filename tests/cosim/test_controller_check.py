"""Faults of an FMU, each told in words; most of them are not seen by `fmpy validate`."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from fmpy.validation import validate_fmu

from cosim.controllers import CONTROLLERS
from cosim.controllers.check import Check, check_fmu
from cosim.fmu.trial import try_fmu
from cosim.matching import PortName
from cosim.soft_body import body_ports
from tests.cosim.helpers import rewritten, variable

Foreign = Callable[..., Path]
Spoil = Callable[[ET.Element], object]


def faults(check: Check) -> list[str]:
    return [finding.text for finding in check.findings if finding.fault]


def notes(check: Check) -> list[str]:
    return [finding.text for finding in check.findings if not finding.fault]


def real(root: ET.Element, name: str) -> ET.Element:
    return variable(root, name)[0]


def declared(root: ET.Element, symbol: str) -> ET.Element:
    listed = root.find(f"UnitDefinitions/Unit[@name='{symbol}']/BaseUnit")
    assert listed is not None
    return listed


def wrong_base_unit(root: ET.Element) -> None:
    declared(root, "cmH2O").set("factor", "1.0")


def wrong_base_unit_of_a_parameter(root: ET.Element) -> None:
    declared(root, "s").set("factor", "60")


def wrong_model_identifier(root: ET.Element) -> None:
    root.find("CoSimulation").set("modelIdentifier", "Elsewhere")


def start_below_min(root: ET.Element) -> None:
    real(root, "rest_volume").set("start", "-1")


def start_above_max(root: ET.Element) -> None:
    real(root, "band").set("max", "0.25")


def bounds_the_wrong_way(root: ET.Element) -> None:
    real(root, "d").attrib.update({"min": "9", "max": "3"})


def start_of_another_type(root: ET.Element) -> None:
    real(root, "period").set("start", "long")


MISSED_BY_FMPY: Mapping[Spoil, str] = {
    wrong_base_unit: "unit 'cmH2O' is declared as 1 ",
    wrong_base_unit_of_a_parameter: "unit 's' is declared as 60 [time]^1, but s is 1 [time]^1",
    wrong_model_identifier: "'Elsewhere', but the binary for this machine is named PaperController",
    start_below_min: "rest_volume: start = -1 is outside its own bounds, 0 to inf",
    start_above_max: "band: start = 0.5 is outside its own bounds, 1e-06 to 0.25",
    bounds_the_wrong_way: "d: min = 9 is above max = 3",
}


@pytest.mark.parametrize("spoil", MISSED_BY_FMPY)
def test_fault_that_fmpy_does_not_see_is_told(paper: Path, tmp_path: Path, spoil: Spoil) -> None:
    fmu = rewritten(paper, tmp_path / "spoilt.fmu", spoil)
    assert validate_fmu(str(fmu)) == []
    listed = check_fmu(fmu, body_ports())
    assert not listed.ok
    assert any(MISSED_BY_FMPY[spoil] in text for text in faults(listed))


def renamed(old: str, new: str) -> Spoil:
    def rename(root: ET.Element) -> None:
        variable(root, old).set("name", new)

    return rename


def no_unit(root: ET.Element) -> None:
    real(root, "delta_p").attrib.pop("unit")


def pressure_for_a_volume(root: ET.Element) -> None:
    real(root, "volume").set("unit", "cmH2O")


def unknown_unit(root: ET.Element) -> None:
    real(root, "volume").set("unit", "puff")


def drives_nothing(root: ET.Element) -> None:
    renamed("delta_p", "Paw")(root)
    renamed("n", "N")(root)


def model_exchange_only(root: ET.Element) -> None:
    root.find("CoSimulation").tag = "ModelExchange"


def constant_output(root: ET.Element) -> None:
    variable(root, "n").set("variability", "constant")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (drives_nothing, "cannot drive the body: it has neither an output delta_p (Pa) nor"),
        (renamed("volume", "volumen"), "has an input 'volumen' that the body does not give; did "),
        (no_unit, "output delta_p, for the body's delta_p, declares no unit; expected one that "),
        (pressure_for_a_volume, "for the body's volume: 'm3' cannot be converted to 'cmH2O'"),
        (unknown_unit, "unit 'puff' of volume is neither declared"),
        (model_exchange_only, "offers no co-simulation"),
        (constant_output, "output n has variability 'constant'"),
        (start_of_another_type, "period: start = 'long', min = '1e-06', max = None: expected num"),
    ],
)
def test_what_keeps_it_from_a_body_is_told(
    paper: Path, tmp_path: Path, spoil: Spoil, message: str
) -> None:
    listed = check_fmu(rewritten(paper, tmp_path / "spoilt.fmu", spoil), body_ports())
    assert not listed.ok
    assert any(message in text for text in faults(listed)), faults(listed)


def test_all_faults_are_told_at_once(paper: Path, tmp_path: Path) -> None:
    def spoil(root: ET.Element) -> None:
        for fault in (wrong_base_unit, start_below_min, renamed("volume", "V"), drives_nothing):
            fault(root)

    message = " ".join(faults(check_fmu(rewritten(paper, tmp_path / "s.fmu", spoil), body_ports())))
    for fragment in ("declared as 1 ", "rest_volume: start", "input 'V'", "cannot drive the body"):
        assert fragment in message


def tool_needed(root: ET.Element) -> None:
    root.find("CoSimulation").set("needsExecutionTool", "true")


def one_step(root: ET.Element) -> None:
    root.find("CoSimulation").set("canHandleVariableCommunicationStepSize", "false")
    root.find("DefaultExperiment").set("stepSize", "0.02")


def no_state(root: ET.Element) -> None:
    for flag in ("canGetAndSetFMUstate", "canSerializeFMUstate"):
        root.find("CoSimulation").set(flag, "false")


def no_step_size(root: ET.Element) -> None:
    root.find("DefaultExperiment").attrib.pop("stepSize")


def no_base_unit(root: ET.Element) -> None:
    unit = root.find("UnitDefinitions/Unit[@name='cmH2O']")
    unit.remove(unit.find("BaseUnit"))


def no_initial_unknowns(root: ET.Element) -> None:
    root.find("ModelStructure").remove(root.find("ModelStructure/InitialUnknowns"))


NOTES: Mapping[Spoil, str] = {
    tool_needed: "needsExecutionTool = true",
    one_step: "steps by 0.02 s and cannot vary its step",
    no_state: "cannot save and restore its state",
    no_base_unit: "unit cmH2O without a BaseUnit",
    no_step_size: "DefaultExperiment has no stepSize",
    renamed("phase", "state"): "no output phase",
    no_initial_unknowns: "fmpy validate: ModelStructure/InitialUnknowns",
}


@pytest.fixture
def untried(monkeypatch: pytest.MonkeyPatch) -> None:
    """No trial: its process takes a second to start."""
    monkeypatch.setattr("cosim.controllers.check.try_fmu", lambda *_: [])


@pytest.mark.parametrize("spoil", NOTES)
def test_what_other_tools_mind_is_noted_and_no_fault(
    paper: Path, tmp_path: Path, untried: None, spoil: Spoil
) -> None:
    listed = check_fmu(rewritten(paper, tmp_path / "spoilt.fmu", spoil), body_ports())
    assert listed.ok, faults(listed)
    assert any(text.startswith(NOTES[spoil]) for text in notes(listed)), notes(listed)


def test_script_with_the_name_of_a_standard_module_is_noted(
    paper: Path, tmp_path: Path, untried: None
) -> None:
    copy = tmp_path / "spoilt.fmu"
    with zipfile.ZipFile(paper) as old, zipfile.ZipFile(copy, "w") as new:
        stem = old.read("resources/slavemodule.txt").decode()
        for name in old.namelist():
            data = b"colorsys" if name.endswith("slavemodule.txt") else old.read(name)
            new.writestr(name.replace(stem, "colorsys"), data)
    listed = check_fmu(copy, body_ports())
    assert listed.ok  # here it runs under a name of its own
    assert any("colorsys.py has the name of a standard module" in text for text in notes(listed))


@pytest.mark.parametrize("content", [None, b"This is no FMU."], ids=["missing", "no archive"])
def test_file_that_is_no_fmu_is_a_finding_too(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "x.fmu"
    if content is not None:
        path.write_bytes(content)
    listed = check_fmu(path, body_ports())
    assert (listed.ok, len(faults(listed)), listed.ports) == (False, 1, [])


def test_binary_for_another_machine_is_told_beside_the_rest(paper: Path, tmp_path: Path) -> None:
    path = tmp_path / "foreign.fmu"
    spoilt = rewritten(paper, tmp_path / "spoilt.fmu", start_below_min)
    with zipfile.ZipFile(spoilt) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            if not name.startswith(("binaries/", "resources/")):
                new.writestr(name, old.read(name))
        new.writestr("binaries/darwin64/PaperController.dylib", b"")
    message = faults(check_fmu(path, body_ports()))
    assert any("it runs on: darwin64" in text for text in message)
    assert any("rest_volume: start" in text for text in message)


def test_ports_say_what_they_connect_to(shipped: Mapping[str, Path], untried: None) -> None:
    listed = check_fmu(shipped["pressure-support"], body_ports())
    assert (listed.ok, listed.findings) == (True, [])
    assert listed.title == "FMI 2.0, PressureSupport"
    uses = {use.port.name: use for use in listed.ports}
    assert uses["flow"].partner.name == "flow"
    assert uses["flow"].factor == pytest.approx(60_000, rel=1e-15)  # m3/s to L/min
    assert uses["delta_p"].factor == pytest.approx(98.0665, rel=1e-15)
    assert uses["respiratory_pressure"].partner is None


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTROLLERS)
def test_nothing_is_found_in_what_ships(shipped: Mapping[str, Path], name: str) -> None:
    listed = check_fmu(shipped[name], body_ports())
    assert (listed.ok, listed.findings) == (True, [])


def test_names_and_units_can_be_given(paper: Path, tmp_path: Path, untried: None) -> None:
    def spoil(root: ET.Element) -> None:
        drives_nothing(root)
        renamed("volume", "V_lung")(root)
        real(root, "V_lung").attrib.pop("unit")

    fmu = rewritten(paper, tmp_path / "other.fmu", spoil)
    names = {"delta_p": PortName("Paw"), "volume": PortName("V_lung", "mL")}
    listed = check_fmu(fmu, body_ports(), names)
    assert listed.ok, faults(listed)
    uses = {use.port.name: use for use in listed.ports}
    assert (uses["Paw"].partner.name, uses["V_lung"].partner.name) == ("delta_p", "volume")
    assert uses["V_lung"].factor == pytest.approx(1e6, rel=1e-15)  # m3 to mL


# What only a trial tells: the binary's word.


def test_another_guid_is_told_by_the_binary(foreign: Foreign, tmp_path: Path) -> None:
    spoilt = rewritten(foreign(2), tmp_path / "s.fmu", lambda root: root.set("guid", "{other}"))
    assert len(validate_fmu(str(spoilt))) == len(validate_fmu(str(foreign(2))))
    (message,) = faults(check_fmu(spoilt, body_ports()))
    assert message.startswith("in a trial: could not be loaded")


@pytest.mark.slow  # a process each
@pytest.mark.parametrize(
    ("defect", "message"),
    [
        ("NAN_OUTPUT", "delta_p = nan at t = "),
        ("CRASH", "in a trial: crashed"),
        ("HANG", "within 1 s"),
        ("STATUS=3", "in a trial: could not step from t = "),
    ],
)
def test_failing_binary_is_told(foreign: Foreign, defect: str, message: str) -> None:
    listed = list(try_fmu(foreign(2, defect), {"volume": 2.5}, 1 / 30, time_limit=1.0))
    (text,) = [finding.text for finding in listed if finding.fault]
    assert message in text
