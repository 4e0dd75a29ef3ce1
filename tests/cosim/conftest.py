"""FMUs that several tests use, built once a session."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from cosim.controllers import CONTROLLERS, build, controller_source
from tests.cosim.helpers import run_python

FMUS = Path(__file__).with_name("fmus")

GAIN = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

class {name}(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.y = 0.0
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.y = {value}
        return True
"""

BUILD = """
import sys
from pathlib import Path
from pythonfmu import FmuBuilder

for script in sys.argv[1:]:
    sys.modules.pop(Path(script).stem, None)
    FmuBuilder.build_FMU(script, dest=Path(script).parent / "out.fmu")
"""

BUILD3 = """
import sys
from pythonfmu3 import FmuBuilder

print(FmuBuilder.build_FMU(sys.argv[1], dest=sys.argv[2]))
"""


@pytest.fixture(scope="session")
def shipped(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    """The controllers that ship, by name."""
    folder = tmp_path_factory.mktemp("shipped")
    return {name: build(controller_source(name), folder / f"{name}.fmu") for name in CONTROLLERS}


@pytest.fixture(scope="session")
def paper(shipped: Mapping[str, Path]) -> Path:
    return shipped["paper"]


@pytest.fixture(scope="session")
def pressure(shipped: Mapping[str, Path]) -> Path:
    return shipped["pressure-control"]


@pytest.fixture(scope="session")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(FMUS / "faulty.py", tmp_path_factory.mktemp("faulty") / "faulty.fmu")


@pytest.fixture(scope="session")
def reservoir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An FMI 3.0 FMU."""
    folder = tmp_path_factory.mktemp("reservoir")
    done = run_python(BUILD3, FMUS / "reservoir.py", folder)
    assert done.returncode == 0, done.stderr
    return Path(done.stdout.split()[-1])


@pytest.fixture(scope="session")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    """FMUs as pythonfmu builds them: y = 2, y = 3, y = 5 from another class, y = 7."""
    folder = tmp_path_factory.mktemp("plain")
    scripts = {
        "two": ("gain", "Gain", 2.0),
        "three": ("gain", "Gain", 3.0),
        "other": ("gain", "Other", 5.0),
        "loaded": ("colorsys", "Gain", 7.0),  # the name of a standard module
    }
    paths = []
    for key, (stem, name, value) in scripts.items():
        script = folder / key / f"{stem}.py"
        script.parent.mkdir()
        script.write_text(GAIN.format(name=name, value=value))
        paths.append(script)
    done = run_python(BUILD, *paths)
    assert done.returncode == 0, done.stderr
    return {key: folder / key / "out.fmu" for key in scripts}


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder in which all temporary folders of the test are made."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder
