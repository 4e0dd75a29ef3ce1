from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from cosim import FmuError, FmuParticipant, unit
from tests.cosim.helpers import rewritten, variable

Spoil = Callable[[ET.Element], object]


def refusal(path: Path) -> str:
    with pytest.raises(FmuError) as caught:
        FmuParticipant(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def declared(root: ET.Element, symbol: str) -> ET.Element:
    result = root.find(f"UnitDefinitions/Unit[@name='{symbol}']")
    assert result is not None
    return result


def rename_unit(root: ET.Element, old: str, new: str) -> None:
    declared(root, old).set("name", new)
    for element in root.iter("Real"):
        if element.get("unit") == old:
            element.set("unit", new)


def test_missing_file_is_refused(tmp_path: Path) -> None:
    assert "does not exist" in refusal(tmp_path / "nowhere.fmu")


def test_file_that_is_no_zip_is_refused(tmp_path: Path, temporary: Path) -> None:
    path = tmp_path / "text.fmu"
    path.write_text("This is no FMU.")
    assert "is no FMU" in refusal(path)
    assert list(temporary.iterdir()) == []


def test_zip_without_a_description_is_refused(tmp_path: Path, temporary: Path) -> None:
    path = tmp_path / "empty.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "nothing here")
    assert "no modelDescription.xml" in refusal(path)
    assert list(temporary.iterdir()) == []


def test_description_that_is_no_xml_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "garbled.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", "<fmiModelDescription")
    assert "modelDescription.xml cannot be read" in refusal(path)


def model_exchange_only(root: ET.Element) -> None:
    root.find("CoSimulation").tag = "ModelExchange"


def fmi_4(root: ET.Element) -> None:
    root.set("fmiVersion", "4.0")


def binary_of_another_name(root: ET.Element) -> None:
    root.find("CoSimulation").set("modelIdentifier", "Elsewhere")


def pascals_called_cmh2o(root: ET.Element) -> None:
    declared(root, "cmH2O")[0].set("factor", "1.0")


def cmh2o_as_a_length(root: ET.Element) -> None:
    base = declared(root, "cmH2O")[0]
    base.attrib.clear()
    base.attrib.update({"m": "1", "factor": "98.0665"})


def celsius_without_its_offset(root: ET.Element) -> None:
    rename_unit(root, "s", "degC")
    base = declared(root, "degC")[0]
    base.attrib.clear()
    base.set("K", "1")


def unknown_unit(root: ET.Element) -> None:
    variable(root, "volume")[0].set("unit", "puff")


def fixed_input(root: ET.Element) -> None:
    variable(root, "volume").set("variability", "fixed")


def constant_output(root: ET.Element) -> None:
    variable(root, "n").set("variability", "constant")


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (model_exchange_only, "offers no co-simulation"),
        (fmi_4, "version: 4.0); expected one of FMI 1.0, 2.0 or 3.0"),
        (binary_of_another_name, "has no binary for this machine (binaries/"),
        (pascals_called_cmh2o, "unit 'cmH2O' is declared as 1 "),
        (cmh2o_as_a_length, "unit 'cmH2O' is declared as 98.0665 [length]"),
        (celsius_without_its_offset, "but degC is 1 [temperature]^1 + 273.15"),
        (unknown_unit, "unit 'puff' of volume is neither declared"),
        (fixed_input, 'causality="input" and variability="fixed"'),
        (constant_output, "output n has variability 'constant'"),
    ],
)
def test_faulty_description_is_refused_with_its_fault(
    paper: Path, tmp_path: Path, temporary: Path, spoil: Spoil, message: str
) -> None:
    assert message in refusal(rewritten(paper, tmp_path / "spoilt.fmu", spoil))
    assert list(temporary.iterdir()) == []


def test_binary_for_another_platform_only_is_refused_and_the_platform_named(
    paper: Path, tmp_path: Path
) -> None:
    path = tmp_path / "foreign.fmu"
    with zipfile.ZipFile(paper) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            if not name.startswith(("binaries/", "resources/")):
                new.writestr(name, old.read(name))
        new.writestr("binaries/darwin64/PaperController.dylib", b"")
    assert "it runs on: darwin64" in refusal(path)


def ports_after(paper: Path, tmp_path: Path, edit: Spoil) -> dict[str, object]:
    fmu = FmuParticipant(rewritten(paper, tmp_path / "edited.fmu", edit))
    fmu.close()
    return {name: port.unit for name, port in fmu.ports.items()}


def test_declared_unit_of_an_unknown_name_is_taken_from_its_base_unit(
    paper: Path, tmp_path: Path
) -> None:
    units = ports_after(paper, tmp_path, lambda root: rename_unit(root, "L", "lungful"))
    assert units["volume"].factor == 1e-3
    assert units["volume"].dimension == unit("L").dimension


def test_known_unit_without_a_base_unit_is_taken_from_its_name(paper: Path, tmp_path: Path) -> None:
    def undeclare(root: ET.Element) -> None:
        root.remove(root.find("UnitDefinitions"))

    assert ports_after(paper, tmp_path, undeclare)["delta_p"] == unit("cmH2O")


def test_base_unit_rounded_to_six_digits_is_accepted(paper: Path, tmp_path: Path) -> None:
    def rounded(root: ET.Element) -> None:
        rename_unit(root, "s", "mmHg")
        declared(root, "mmHg")[0].attrib.update(
            {"kg": "1", "m": "-1", "s": "-2", "factor": "133.322"}
        )

    fmu = FmuParticipant(rewritten(paper, tmp_path / "edited.fmu", rounded))
    fmu.close()
    assert fmu.ports["volume"].unit == unit("L")


def test_unit_of_a_declared_type_counts(paper: Path, tmp_path: Path) -> None:
    def by_type(root: ET.Element) -> None:
        types = ET.Element("TypeDefinitions")
        ET.SubElement(ET.SubElement(types, "SimpleType", name="Volume"), "Real", unit="L")
        root.insert(list(root).index(root.find("UnitDefinitions")) + 1, types)
        real = variable(root, "volume")[0]
        del real.attrib["unit"]
        real.set("declaredType", "Volume")

    assert ports_after(paper, tmp_path, by_type)["volume"] == unit("L")
