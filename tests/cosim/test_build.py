from __future__ import annotations

import sys
from pathlib import Path

import pytest

from cosim import ControllerError, FmuError, FmuParticipant
from cosim.controllers import build
from cosim.controllers.build import content_hash
from tests.cosim.helpers import description, variable

SOURCE = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

class Probe(Fmi2Slave):
    units = {units}
    bounds = {bounds}

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x = 1.0
        self.gain = 2.0
        self.register_variable(Real("x", causality=Fmi2Causality.output))
        fixed = Fmi2Variability.fixed
        self.register_variable(Real("gain", causality=Fmi2Causality.parameter, variability=fixed))

    def do_step(self, current_time, step_size):
        return True
"""


def source(folder: Path, units: str = "{}", bounds: str = "{}") -> Path:
    path = folder / "probe.py"
    path.write_text(SOURCE.format(units=units, bounds=bounds))
    return path


@pytest.mark.parametrize(
    ("symbol", "base"),
    [
        ("cmH2O", {"kg": "1", "m": "-1", "s": "-2", "factor": "98.0665"}),
        ("degC", {"K": "1", "offset": "273.15"}),
        ("A", {"A": "1"}),
        ("mol/L", {"mol": "1", "m": "-3", "factor": "1000.0"}),
        ("cd", {"cd": "1"}),
        ("1", {}),
    ],
)
def test_units_are_written_with_their_base_unit(
    tmp_path: Path, symbol: str, base: dict[str, str]
) -> None:
    fmu = build(source(tmp_path, f"{{'x': '{symbol}'}}"), tmp_path / "probe.fmu")
    root = description(fmu)
    (definition,) = root.findall("UnitDefinitions/Unit")
    assert definition.get("name") == symbol
    assert definition[0].attrib == base
    assert variable(root, "x")[0].get("unit") == symbol


def test_bounds_are_written_and_kept(tmp_path: Path) -> None:
    fmu = build(source(tmp_path, bounds="{'gain': (0.5, None)}"), tmp_path / "probe.fmu")
    real = variable(description(fmu), "gain")[0]
    assert (real.get("min"), real.get("max")) == ("0.5", None)
    with pytest.raises(FmuError, match=r"expected at least 0\.5"):
        FmuParticipant(fmu, parameters={"gain": 0.25})


def test_state_is_promised_only_where_it_is_complete(tmp_path: Path, paper: Path) -> None:
    probe = description(build(source(tmp_path), tmp_path / "probe.fmu")).find("CoSimulation")
    shipped = description(paper).find("CoSimulation")
    for flag in ("canGetAndSetFMUstate", "canSerializeFMUstate"):
        assert (probe.get(flag), shipped.get(flag)) == ("false", "true")


def test_another_source_gives_another_identity(tmp_path: Path) -> None:
    first = build(source(tmp_path), tmp_path / "one.fmu")
    other = build(source(tmp_path, "{'x': 'L'}"), tmp_path / "other.fmu")
    assert description(first).get("guid") != description(other).get("guid")


def test_hash_follows_the_content_and_not_the_name(tmp_path: Path) -> None:
    first = source(tmp_path)
    copy = tmp_path / "copy.py"
    copy.write_bytes(first.read_bytes())
    assert content_hash(first) == content_hash(copy)
    copy.write_text(copy.read_text() + "\n")
    assert content_hash(first) != content_hash(copy)


def test_build_leaves_no_trace_in_the_process(tmp_path: Path, temporary: Path) -> None:
    before = list(sys.path), set(sys.modules)
    build(source(tmp_path), tmp_path / "probe.fmu")
    assert (list(sys.path), set(sys.modules)) == before
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("units", "bounds", "message"),
    [
        ("{'y': 'L'}", "{}", "unit or bounds for 'y'"),
        ("{}", "{'y': (0, 1)}", "unit or bounds for 'y'"),
        ("{'x': 'puff'}", "{}", "Probe: unit 'puff' is not known"),
        ("1 / 0", "{}", "cannot be built: ZeroDivisionError: division by zero"),
    ],
)
def test_faulty_source_is_refused_with_its_fault(
    tmp_path: Path, units: str, bounds: str, message: str
) -> None:
    with pytest.raises(ControllerError) as caught:
        build(source(tmp_path, units, bounds), tmp_path / "probe.fmu")
    assert message in str(caught.value)
    assert not (tmp_path / "probe.fmu").exists()


def test_missing_source_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ControllerError, match="does not exist"):
        build(tmp_path / "nothing.py", tmp_path / "probe.fmu")


def test_source_without_a_controller_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "empty.py"
    path.write_text("x = 1\n")
    with pytest.raises(ControllerError, match="No child class of Fmi2Slave"):
        build(path, tmp_path / "empty.fmu")
