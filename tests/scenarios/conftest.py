"""A small scene, its dataset, and a command line that runs in this process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
import xarray as xr

import scenarios
from cosim.controllers import build
from scenarios.__main__ import main

SMALL = {"mesh.icosphere": 2, "run.cycles": 1}

FMUS = Path(__file__).with_name("fmus")


class Said(NamedTuple):
    """What the command line gave back, and printed with its lines joined."""

    code: int
    out: str
    error: str
    error_lines: int


Cli = Callable[..., Said]


@pytest.fixture(scope="session")
def small() -> scenarios.Scenario:
    """One breath of a sphere of 162 points."""
    return scenarios.load("sphere-lung", SMALL)


@pytest.fixture(scope="session")
def sphere(small: scenarios.Scenario) -> xr.Dataset:
    """Dataset of that breath. Shared: do not change it."""
    return scenarios.run(small)


@pytest.fixture(scope="session")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Build one of the controllers in the folder fmus; each is built once."""
    folder = tmp_path_factory.mktemp("fmus")

    def built(name: str) -> Path:
        path = folder / f"{name}.fmu"
        return path if path.exists() else build(FMUS / f"{name}.py", path)

    return built


@pytest.fixture
def cli(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Cli:
    """Run a command line in this process, in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: str) -> Said:
        code = main(list(arguments))
        said = capsys.readouterr()
        lines = len(said.err.splitlines())
        return Said(code, " ".join(said.out.split()), " ".join(said.err.split()), lines)

    return run
