"""The traps of Python FMUs: each is there with bare fmpy, and closed by `FmuParticipant`.

Bare fmpy runs in a process of its own, because it crashes, or spoils ``sys``.
"""

from __future__ import annotations

import colorsys
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from cosim import FmuError, FmuParticipant
from tests.cosim.helpers import run_python

Plain = Mapping[str, Path]

BARE = """
import sys, colorsys, os
import fmpy
from fmpy.fmi2 import FMU2Slave

def run(path):
    folder = fmpy.extract(path)
    model = fmpy.read_model_description(folder)
    fmu = FMU2Slave(
        guid=model.guid,
        unzipDirectory=folder,
        modelIdentifier=model.coSimulation.modelIdentifier,
        instanceName="bare",
    )
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    fmu.doStep(0.0, 1.0)
    (value,) = fmu.getReal([0])
    fmu.terminate()
    fmu.freeInstance()
    return value

here, length = os.getcwd(), len(sys.path)
try:
    print([run(path) for path in sys.argv[1:]])
except Exception as error:
    print("failed:", error)
print("cwd is the same:", os.getcwd() == here)
print("sys.path grew by", len(sys.path) - length)
"""


def outputs(*paths: Path) -> list[float]:
    """What FMUs give that are alive at the same time."""
    fmus = [FmuParticipant(path) for path in paths]
    try:
        for fmu in fmus:
            fmu.initialize(0.0)
        for fmu in fmus:
            fmu.begin()
        for fmu in fmus:
            fmu.step(0.0, 1.0)
        return [fmu.read()["y"] for fmu in fmus]
    finally:
        for fmu in fmus:
            fmu.close()


@pytest.fixture
def broken(plain: Plain, tmp_path: Path) -> Path:
    """An FMU whose binary is no library."""
    copy = tmp_path / "broken.fmu"
    with zipfile.ZipFile(plain["two"]) as old, zipfile.ZipFile(copy, "w") as new:
        for name in old.namelist():
            new.writestr(name, b"nonsense" if name.startswith("binaries/") else old.read(name))
    return copy


def test_bare_runs_the_first_of_two_scripts_of_one_name_twice(plain: Plain) -> None:
    assert "[2.0, 2.0]" in run_python(BARE, plain["two"], plain["three"]).stdout


def test_two_scripts_of_one_name_each_run_their_own_code(plain: Plain) -> None:
    assert outputs(plain["two"], plain["three"]) == [2.0, 3.0]
    assert outputs(plain["three"], plain["two"], plain["three"]) == [3.0, 2.0, 3.0]


def test_one_after_the_other_they_do_too(plain: Plain) -> None:
    assert [outputs(plain[key]) for key in ("two", "three", "two")] == [[2.0], [3.0], [2.0]]


def test_bare_cannot_load_another_class_of_the_same_script_name(plain: Plain) -> None:
    message = run_python(BARE, plain["two"], plain["other"]).stdout
    assert "failed: Failed to instantiate" in message


def test_another_class_of_the_same_script_name_runs(plain: Plain) -> None:
    assert outputs(plain["two"], plain["other"]) == [2.0, 5.0]


def test_bare_fails_on_a_script_named_like_a_loaded_module(plain: Plain) -> None:
    done = run_python(BARE, plain["loaded"])
    # A segmentation fault with some builds of the binary, a failed load with others.
    assert done.returncode != 0 or "failed:" in done.stdout


def test_script_named_like_a_loaded_module_runs_and_leaves_it_alone(plain: Plain) -> None:
    assert outputs(plain["loaded"]) == [7.0]
    assert sys.modules["colorsys"] is colorsys


def test_bare_leaves_entries_in_the_module_search_path(plain: Plain) -> None:
    assert "sys.path grew by 2" in run_python(BARE, plain["two"], plain["two"]).stdout


def test_search_path_and_modules_stay_as_they_were(plain: Plain) -> None:
    before = list(sys.path), set(sys.modules)
    outputs(plain["two"], plain["three"])
    assert (list(sys.path), set(sys.modules)) == before


def test_bare_leaves_the_working_directory_changed_after_a_failure(broken: Path) -> None:
    assert "cwd is the same: False" in run_python(BARE, broken).stdout


def test_working_directory_and_folders_stay_after_a_failure(
    broken: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(temporary.parent)
    with pytest.raises(FmuError, match="could not be loaded"):
        outputs(broken)
    assert Path.cwd() == temporary.parent
    assert list(temporary.iterdir()) == []
