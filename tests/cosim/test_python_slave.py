"""A Python FMU as its script: what its binary does, to the bit, and where there is no binary."""

from __future__ import annotations

import math
import shutil
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import fmpy
import pytest

from cosim import FmuError, FmuParticipant
from cosim.controllers import CONTROLLERS, build
from cosim.controllers.check import check_fmu
from cosim.fmu.isolation import IsolatedFmu, open_fmu
from cosim.participant import Causality
from cosim.soft_body import body_ports
from tests.cosim.test_controllers import FRAME, FRAMES, start, walk

BOTH = ("fmu", "python")


@pytest.fixture
def repacked(tmp_path: Path) -> Callable[..., Path]:
    """Copy an FMU, with its binaries changed by a function of name and content; None drops one."""

    def repack(fmu: Path, change: Callable[[str, bytes], bytes | None]) -> Path:
        target = tmp_path / f"changed-{fmu.name}"
        with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(target, "w") as new:
            for name in old.namelist():
                content = old.read(name)
                changed = change(name, content) if name.startswith("binaries/") else content
                if changed is not None:
                    new.writestr(name, changed)
        return target

    return repack


def without_binaries(_: str, __: bytes) -> None:
    return None


def for_another_processor(_: str, content: bytes) -> bytes:
    machine = bytes([0x15, 0x00])  # PowerPC, in an ELF header
    return content[:18] + machine + content[20:] if content[:4] == b"\x7fELF" else content


@pytest.mark.parametrize("name", CONTROLLERS)
def test_both_ways_are_the_same_controller_to_the_bit(
    shipped: Mapping[str, Path], name: str
) -> None:
    """Two breaths, with a state that is saved, gone back to, and written down."""
    series, ports, data = {}, {}, {}
    for way in BOTH:
        fmu = start(FmuParticipant(shipped[name], run_as=way))
        try:
            assert fmu.run_as == way
            ports[way] = dict(fmu.ports)
            first = walk(fmu, 0, FRAMES // 3)
            saved, data[way] = fmu.get_state(), fmu.serialize()
            onward = walk(fmu, FRAMES // 3, 2 * FRAMES)
            fmu.set_state(saved)
            assert walk(fmu, FRAMES // 3, 2 * FRAMES) == onward
            fmu.free_state(saved)
            fmu.deserialize(data[way])
            assert walk(fmu, FRAMES // 3, 2 * FRAMES) == onward
            series[way] = [*first, *onward]
        finally:
            fmu.close()
    assert len({tuple(row.items()) for row in series["fmu"]}) > 1  # it does something
    assert series["fmu"] == series["python"]
    assert ports["fmu"] == ports["python"]
    assert data["fmu"] == data["python"]  # so a checkpoint goes on the other way, too


@pytest.mark.parametrize("way", BOTH)
def test_a_state_written_down_one_way_is_read_the_other(
    shipped: Mapping[str, Path], way: str
) -> None:
    other = BOTH[1 - BOTH.index(way)]
    one, two = (start(FmuParticipant(shipped["pid"], run_as=w)) for w in (way, other))
    try:
        walk(one, 0, 30)
        two.deserialize(one.serialize())
        assert walk(one, 30, 60) == walk(two, 30, 60)
    finally:
        one.close()
        two.close()


@pytest.mark.parametrize("way", BOTH)
@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("initialization", r"could not leave initialization: fmi2ExitInitializationMode answered"),
        ("step", r"could not step from t = 0 s by 0.0333333 s: fmi2DoStep answered with status 4"),
        ("refusal", "asked to end the simulation at t = 0 s"),
    ],
)
def test_a_script_fails_alike_both_ways(faulty: Path, way: str, fault: str, message: str) -> None:
    fmu = FmuParticipant(faulty, parameters={"fault": fault}, run_as=way)
    with pytest.raises(FmuError, match=message) as caught:
        start(fmu).step(0.0, FRAME)
    fmu.close()
    if fault == "step":
        assert "RuntimeError" in str(caught.value)
        assert "the pump has stopped" in str(caught.value)


def test_a_script_that_fails_says_where(faulty: Path) -> None:
    fmu = FmuParticipant(faulty, parameters={"fault": "step"}, run_as="python")
    fmu.initialize(0.0)
    fmu.begin()
    with pytest.raises(FmuError, match=r"the pump has stopped \(line \d+, do_step\)"):
        fmu.step(0.0, 0.5)
    fmu.close()


@pytest.mark.parametrize("way", BOTH)
def test_logged_warnings_come_through(tmp_path: Path, way: str) -> None:
    script = tmp_path / "warns.py"
    script.write_text(
        "from pythonfmu import Fmi2Causality, Fmi2Slave, Real\n"
        "from pythonfmu.enums import Fmi2Status\n"
        "class Warns(Fmi2Slave):\n"
        "    def __init__(self, **kwargs):\n"
        "        super().__init__(**kwargs)\n"
        "        self.y = 1.0\n"
        "        self.register_variable(Real('y', causality=Fmi2Causality.output))\n"
        "        self.log('made')\n"
        "    def do_step(self, current_time, step_size):\n"
        "        self.log('high pressure', Fmi2Status.warning)\n"
        "        return True\n"
    )
    fmu = start(FmuParticipant(build(script, tmp_path / "warns.fmu"), run_as=way))
    fmu.step(0.0, FRAME)
    assert fmu.log.warnings == ["high pressure"]
    assert "[ok] made" in fmu.log.messages
    fmu.close()


def test_a_script_runs_where_no_binary_fits(
    shipped: Mapping[str, Path], repacked: Callable[..., Path]
) -> None:
    for change in (without_binaries, for_another_processor):
        if change is for_another_processor and not fmpy.platform.startswith("linux"):
            continue  # only ELF says in its header what it is for
        fmu = start(FmuParticipant(repacked(shipped["paper"], change)))
        assert fmu.run_as == "python"
        fmu.step(0.0, FRAME)
        assert fmu.read()["n"] > 0
        fmu.close()


def test_a_binary_that_does_not_fit_is_refused_by_name(
    shipped: Mapping[str, Path], repacked: Callable[..., Path]
) -> None:
    bare = repacked(shipped["paper"], without_binaries)
    with pytest.raises(FmuError, match=r"has no binary for this machine .* it runs on: none"):
        FmuParticipant(bare, run_as="fmu")


@pytest.mark.skipif(not fmpy.platform.startswith("linux"), reason="ELF says what it is for")
def test_a_binary_of_another_processor_is_refused_by_name(
    shipped: Mapping[str, Path], repacked: Callable[..., Path]
) -> None:
    other = repacked(shipped["paper"], for_another_processor)
    with pytest.raises(FmuError, match=r"no binary for this machine .*, for its processor"):
        FmuParticipant(other, run_as="fmu")


def test_what_is_no_python_fmu_cannot_be_run_as_one(foreign: Callable[..., Path]) -> None:
    with pytest.raises(FmuError, match="holds no Python script"):
        FmuParticipant(foreign(2), run_as="python")


def test_a_script_of_fmi_3_cannot_be_run_as_python(reservoir: Path) -> None:
    with pytest.raises(FmuError, match=r"only scripts of FMI 2\.0"):
        FmuParticipant(reservoir, run_as="python")


def test_in_a_process_of_its_own_it_is_the_same(shipped: Mapping[str, Path]) -> None:
    outputs = []
    for isolation in ("none", "process"):
        fmu = start(open_fmu(shipped["paper"], "c", {}, run_as="python", isolation=isolation))
        assert isinstance(fmu, IsolatedFmu) == (isolation == "process")
        outputs.append(walk(fmu, 0, 40))
        fmu.close()
    assert outputs[0] == outputs[1]


def test_two_scripts_with_helpers_of_one_name_keep_their_own(tmp_path: Path) -> None:
    values = {}
    for key, value in (("a", 2.0), ("b", 3.0)):
        folder = tmp_path / key
        folder.mkdir()
        (folder / "helper.py").write_text(f"VALUE = {value}\n")
        (folder / "script.py").write_text(
            "import helper\nfrom pythonfmu import Fmi2Causality, Fmi2Slave, Real\n"
            "class Script(Fmi2Slave):\n"
            "    def __init__(self, **kwargs):\n"
            "        super().__init__(**kwargs)\n"
            "        self.y = helper.VALUE\n"
            "        self.register_variable(Real('y', causality=Fmi2Causality.output))\n"
            "    def do_step(self, current_time, step_size):\n"
            "        return True\n"
        )
        fmu = build(folder / "script.py", folder / "x.fmu", [folder / "helper.py"])
        values[key] = start(FmuParticipant(fmu, run_as="python"))
    read = {key: fmu.read()["y"] for key, fmu in values.items()}
    for fmu in values.values():
        fmu.close()
    assert read == {"a": 2.0, "b": 3.0}


def test_a_script_that_cannot_be_imported_is_named(
    shipped: Mapping[str, Path], tmp_path: Path
) -> None:
    broken = tmp_path / "broken.fmu"
    shutil.copy(shipped["paper"], broken)
    with zipfile.ZipFile(shipped["paper"]) as old, zipfile.ZipFile(broken, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name.startswith("resources/paper") and name.endswith(".py"):
                content += b"\nimport no_such_library\n"
            new.writestr(name, content)
    fmu = FmuParticipant(broken, run_as="python")
    with pytest.raises(FmuError, match=r"its script fails: ModuleNotFoundError: .*no_such_library"):
        fmu.initialize(0.0)
    fmu.close()


def test_inputs_reach_a_script_as_plain_numbers(tmp_path: Path) -> None:
    """As through the binary: a NumPy number in its state could not be written down."""
    import numpy as np

    script = tmp_path / "types.py"
    script.write_text(
        "from pythonfmu import *\n"
        "from pythonfmu import Fmi2Variability\n"
        "class Types(Fmi2Slave):\n"
        "    complete_state = True\n"
        "    def __init__(self, **kwargs):\n"
        "        super().__init__(**kwargs)\n"
        "        self.u, self.k, self.on, self.ok = 0.0, 0, False, 0.0\n"
        "        for kind, name in ((Real, 'u'), (Integer, 'k'), (Boolean, 'on')):\n"
        "            self.register_variable(kind(name, causality=Fmi2Causality.input,\n"
        "                variability=Fmi2Variability.discrete))\n"
        "        self.register_variable(Real('ok', causality=Fmi2Causality.output))\n"
        "    def do_step(self, current_time, step_size):\n"
        "        self.ok = [type(self.u), type(self.k), type(self.on)] == [float, int, bool]\n"
        "        return True\n"
    )
    path = build(script, tmp_path / "types.fmu")
    for way in BOTH:
        fmu = start(FmuParticipant(path, run_as=way))
        inputs = [n for n, port in fmu.ports.items() if port.causality is Causality.INPUT]
        fmu.write({name: np.float64(1) for name in inputs})
        fmu.step(0.0, FRAME)
        assert fmu.read() == {"ok": 1.0}
        assert math.isfinite(len(fmu.serialize()))
        with pytest.raises(FmuError, match="out of the range"):
            fmu.write(dict.fromkeys(inputs, 1e12))
        fmu.close()


def test_a_check_says_that_a_script_is_run_as_python(
    shipped: Mapping[str, Path], repacked: Callable[..., Path]
) -> None:
    result = check_fmu(repacked(shipped["pid"], without_binaries), body_ports())
    assert result.ok
    assert [f.text for f in result.findings] == [
        "has no binary for this machine, so its script is run as Python"
    ]
