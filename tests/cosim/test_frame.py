"""The frame that our controllers share: its text is built into each of their FMUs."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from cosim import ControllerError, FmuError, FmuParticipant
from cosim.controllers import CONTROLLERS, build, controller_source
from cosim.controllers.build import content_hash
from cosim.controllers.standalone import standalone
from cosim.fmu.run_as import RunAs
from tests.cosim.helpers import description, run_python, variable
from tests.cosim.test_controllers import start

SOURCE = '''"""A controller."""

from __future__ import annotations

from cosim.controllers.frame import (
    Controller as Base,
    Frame, local, output, parameter
)


class Probe(Base):
    delta_p = output(0.0, "cmH2O", "time of the frame")
    count = local(0, None, "frames so far")
    last = parameter(9, None, "the last frame", at_least=1)
    frame = parameter(0.1, "s", "time between two actions", at_least=1e-6)

    def act(self, frame: Frame) -> None:
        self.count = self.count + 1
        self.delta_p = frame.time
        self.require(frame.number < self.last, "last", "more")  # line 20
'''

WITHOUT_COSIM = """
import json, sys
sys.modules["cosim"] = sys.modules["softbody_core"] = None  # an import of them fails
import pythonfmu, shutil, fmpy
from fmpy.fmi2 import FMU2Slave
folder = fmpy.extract(sys.argv[1])
model = fmpy.read_model_description(folder)
fmu = FMU2Slave(
    guid=model.guid, unzipDirectory=folder,
    modelIdentifier=model.coSimulation.modelIdentifier, instanceName="alone",
)
fmu.instantiate()
fmu.setupExperiment()
fmu.enterInitializationMode()
fmu.exitInitializationMode()
(delta_p,) = [v.valueReference for v in model.modelVariables if v.name == "delta_p"]
values = []
for i in range(60):
    fmu.doStep(i / 30, 1 / 30)
    values += fmu.getReal([delta_p])
fmu.terminate()
fmu.freeInstance()
shutil.rmtree(folder, ignore_errors=True)
print(json.dumps(values))
"""


@pytest.fixture
def probe(tmp_path: Path) -> Path:
    path = tmp_path / "probe.py"
    path.write_text(SOURCE, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_built_controller_needs_nothing_of_ours(shipped: Mapping[str, Path], name: str) -> None:
    alone = run_python(WITHOUT_COSIM, shipped[name])
    assert alone.returncode == 0, alone.stderr
    fmu = start(FmuParticipant(shipped[name]))
    try:
        values = []
        fmu.write(dict.fromkeys((n for n in ("volume", "flow") if n in fmu.ports), 0.0))
        for i in range(60):
            fmu.step(i / 30, 1 / 30)
            values.append(fmu.read()["delta_p"])
    finally:
        fmu.close()
    assert json.loads(alone.stdout) == values


@pytest.mark.parametrize("name", CONTROLLERS)
def test_no_built_script_imports_ours(shipped: Mapping[str, Path], name: str) -> None:
    with zipfile.ZipFile(shipped[name]) as archive:
        stem = archive.read("resources/slavemodule.txt").decode().strip()
        script = archive.read(f"resources/{stem}.py").decode()
    assert "import cosim" not in script
    assert "from cosim" not in script


def test_a_source_without_the_frame_is_built_as_it_is() -> None:
    plain = Path(__file__).parent / "fmus" / "faulty.py"
    assert standalone(plain) == plain.read_bytes()


def test_the_hash_covers_the_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    source = controller_source("cpap")
    before = content_hash(source)
    monkeypatch.setattr("cosim.controllers.standalone._frame", lambda: "# another frame\n")
    assert content_hash(source) != before


@pytest.mark.parametrize("way", ["fmu", "python"])
def test_names_may_be_changed_on_import(probe: Path, tmp_path: Path, way: RunAs) -> None:
    path = build(probe, tmp_path / "probe.fmu")
    fmu = start(FmuParticipant(path, run_as=way))
    fmu.step(0.0, 0.35)
    assert fmu.read()["delta_p"] == pytest.approx(0.3, rel=1e-5)  # a millionth of a frame late
    fmu.close()
    last = variable(description(path), "last")
    assert (last.get("causality"), last.get("variability")) == ("parameter", "fixed")
    assert (last[0].tag, last[0].get("start"), last[0].get("min")) == ("Integer", "9", "1")


def test_an_error_names_the_line_of_the_source(probe: Path, tmp_path: Path) -> None:
    fmu = start(FmuParticipant(build(probe, tmp_path / "probe.fmu"), run_as="python"))
    (line,) = (n for n, text in enumerate(SOURCE.splitlines(), start=1) if "# line 20" in text)
    frames = r"last = 9: expected more"
    with pytest.raises(FmuError, match=frames) as caught:
        fmu.step(0.0, 1.0)
    fmu.close()
    assert line == 20
    assert "(line 20, act)" in str(caught.value)


@pytest.mark.parametrize("name", ["do_step", "log", "vars"])
def test_a_variable_does_not_take_a_name_that_the_frame_needs(probe: Path, name: str) -> None:
    probe.write_text(SOURCE.replace("last = parameter", f"{name} = parameter"), encoding="utf-8")
    with pytest.raises(ControllerError, match="a controller needs that name"):
        build(probe, probe.with_suffix(".fmu"))
