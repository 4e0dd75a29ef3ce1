from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.metadata import entry_points, version
from pathlib import Path

import pytest
import xarray as xr

import scenarios
import softbody
from scenarios.commands import run as run_command
from tests.scenarios.conftest import FMUS, Cli

SMALL = ["run", "sphere-lung", "--set", "mesh.icosphere=2", "--cycles", "1"]
SCREEN = 24  # lines of a plain terminal

OPEN = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 5\n"


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_one_line_gives_a_dataset_and_a_picture(
    cli: Cli, tmp_path: Path, sphere: xr.Dataset
) -> None:
    said = cli(*SMALL)
    assert said.code == 0
    assert said.error == ""
    assert _names(tmp_path) == ["out.nc", "out.png"]
    xr.testing.assert_equal(xr.load_dataset("out.nc"), sphere)
    assert "wrote out.nc and out.png" in said.out
    tidal = float(scenarios.breaths(sphere)["tidal_volume"][0])
    assert f"{tidal:.3f}" in said.out


def test_quiet_prints_nothing(cli: Cli, tmp_path: Path) -> None:
    said = cli(*SMALL, "--quiet", "-o", "mine.nc", "--no-plot")
    assert (said.code, said.out, said.error) == (0, "", "")
    assert _names(tmp_path) == ["mine.nc"]


def test_options_arrive(cli: Cli) -> None:
    said = cli(
        *SMALL,
        *("--set", "forces.alpha=0.25", "--set", "body.mass=0.9 kg", "--set", 'title="Mine"'),
        *("--controller", "pressure-control", "--positions", "1 s", "--no-plot", "--quiet"),
    )
    assert said.code == 0
    dataset = xr.load_dataset("out.nc")
    assert dataset.attrs["title"] == "Mine"
    assert dataset.attrs["controller"] == "pressure-control"
    assert dataset.sizes["snapshot"] == 5
    again = Path("again.toml")
    again.write_text(dataset.attrs["scenario"])
    kept = scenarios.load(again)
    assert (kept.weights.alpha, kept.body.mass, kept.run.cycles) == (0.25, 0.9, 1)


def test_the_scenario_in_the_file_runs_to_the_same_data(cli: Cli) -> None:
    cli(*SMALL, "--quiet", "--no-plot")
    Path("again.toml").write_text(xr.load_dataset("out.nc").attrs["scenario"])
    assert cli("run", "again.toml", "--quiet", "--no-plot", "-o", "again.nc").code == 0
    xr.testing.assert_equal(xr.load_dataset("again.nc"), xr.load_dataset("out.nc"))


def test_a_built_controller_replaces_the_shipped_one(cli: Cli, sphere: xr.Dataset) -> None:
    assert cli("controller", "build", "paper", "-o", "X.fmu").out == "wrote X.fmu"
    assert cli(*SMALL, "--controller", "X.fmu", "--quiet", "--no-plot").code == 0
    xr.testing.assert_equal(xr.load_dataset("out.nc"), sphere)


def test_a_python_file_becomes_a_controller(cli: Cli) -> None:
    said = cli("controller", "build", str(FMUS / "tells_more.py"), "-o", "mine.fmu")
    assert said.code == 0
    assert cli(*SMALL, "--controller", "mine.fmu", "--quiet", "--no-plot").code == 0
    assert "opening" in xr.load_dataset("out.nc")


def test_the_bare_command_shows_help(cli: Cli) -> None:
    said = cli()
    assert said.code == 0
    assert "softbody run lung" in said.out
    for command in ("run", "list", "controller"):
        assert command in said.out


def test_the_version_is_that_of_the_package(cli: Cli) -> None:
    said = cli("--version")
    assert (said.code, said.out) == (0, version("softbody-cosim"))


def test_the_scenarios_are_listed(cli: Cli) -> None:
    said = cli("list")
    assert said.code == 0
    for name in scenarios.names():
        assert f"{name} {scenarios.load(name).title}" in said.out


def test_the_controllers_are_listed(cli: Cli) -> None:
    said = cli("controller", "list")
    assert said.code == 0
    assert "paper The respiratory pressure-volume controller" in said.out
    assert "pressure-control Pressure-controlled ventilation" in said.out


def _mesh(name: str) -> tuple[str, ...]:
    return "run", "mesh.toml", "--set", f"mesh.file={name}"


BAD_INPUT: dict[str, tuple[tuple[str, ...], list[str]]] = {
    "open mesh": (_mesh("open.obj"), ["4 of 8 edges", "surface is open", "close"]),
    "no mesh": (_mesh("no.obj"), ["mesh", "no triangles"]),
    "no mesh format": (_mesh("no.txt"), ["mesh", "cannot be read", "PLY"]),
    "missing mesh": (_mesh("none.obj"), ["mesh", "does not exist"]),
    "alpha 0": ((*SMALL, "--set", "forces.alpha=0"), ["forces.alpha = 0", "more than 0"]),
    "gamma": ((*SMALL, "--set", "forces.gamma=-1"), ["forces.gamma = -1", "at least 0"]),
    "unknown key": (("run", "key.toml"), ["forces.alhpa is unknown", "did you mean 'alpha'?"]),
    "broken toml": (("run", "broken.toml"), ["broken is no valid TOML", "line 1"]),
    "missing toml": (("run", "none.toml"), ["none.toml cannot be read"]),
    "unknown scenario": (("run", "lnug"), ["'lnug'", "did you mean 'lung'?", ".toml"]),
    "missing fmu": ((*SMALL, "--controller", "none.fmu"), ["does not exist; check the path"]),
    "no fmu": ((*SMALL, "--controller", "no.fmu"), ["is no FMU"]),
    "unknown controller": ((*SMALL, "--controller", "papper"), ["did you mean 'paper'?"]),
    "missing folder": ((*SMALL, "-o", "none/out.nc"), ["folder none does not exist"]),
    "folder": ((*SMALL, "-o", "folder"), ["output folder is a folder", "folder/out.nc"]),
    "picture": ((*SMALL, "-o", "out.png"), ["out.png", "ends in .nc"]),
    "option": ((*SMALL, "--cycle", "3"), ["--cycle", "--cycles"]),
    "command": (("rnu", "lung"), ['Unknown command "rnu"', "run"]),
    "no scenario": (("run",), ["SCENARIO"]),
    "words for cycles": (
        ("run", "lung", "--cycles", "many"),
        ["run.cycles", "many", "a whole number"],
    ),
    "output over a scenario": ((*SMALL, "-o", "key.toml"), ["key.toml", "ends in .nc"]),
    "too many steps": (
        (*SMALL, "--set", "coupling.step=1e-12 s"),
        ["coupling.step = 1e-12 s makes", "at most"],
    ),
    "huge body": ((*SMALL, "--set", "mesh.volume=1e300 L"), ["m wide; expected 1e-09"]),
    "half a cycle": (("run", "lung", "--cycles", "1.5"), ["run.cycles = 1.5", "a whole number"]),
    "positions between steps": (
        (*SMALL, "--positions", "0.05 s"),
        ["positions every 0.05 s", "0.0333333 s"],
    ),
    "misspelt controller table": (
        (*SMALL, "--set", "controller.papre.band=1"),
        ["controller.papre is unknown", "'paper'"],
    ),
    "no cycles": (("run", "lung", "--cycles", "0"), ["run.cycles = 0", "at least 1"]),
    "negative cycles": (("run", "lung", "--cycles=-1"), ["run.cycles = -1", "at least 1"]),
    "set": ((*SMALL, "--set", "forces.alpha"), ["--set 'forces.alpha'", "path=value"]),
    "set nothing": ((*SMALL, "--set", "=3"), ["--set '=3'", "path=value"]),
    "no positions": ((*SMALL, "--positions", "nonsense"), ["--positions", "'1 s'"]),
    "positions, mass": ((*SMALL, "--positions", "1 kg"), ["--positions", "'1 kg'", "'s'"]),
    "positions, short": ((*SMALL, "--positions", "1 ms"), ["positions every 0.001 s", "step"]),
    "positions, nan": ((*SMALL, "--positions", "nan s"), ["positions"]),
    "build unknown": (("controller", "build", "papper", "-o", "X.fmu"), ["did you mean 'paper'?"]),
    "build missing": (("controller", "build", "no.py", "-o", "X.fmu"), ["no.py does not exist"]),
    "build broken": (("controller", "build", "bad.py", "-o", "X.fmu"), ["bad.py cannot be built"]),
    "build where": (("controller", "build", "paper", "-o", "none/X.fmu"), ["none does not exist"]),
}


@pytest.mark.parametrize("case", BAD_INPUT)
def test_bad_input_is_told_on_one_screen_and_nothing_is_written(
    cli: Cli, tmp_path: Path, case: str
) -> None:
    text = scenarios.load("sphere-lung", {"run.cycles": 1}).text
    (tmp_path / "mesh.toml").write_text(re.sub("icosphere = .*", "", text))
    (tmp_path / "key.toml").write_text(text.replace("alpha", "alhpa"))
    (tmp_path / "broken.toml").write_text("mesh = = 3")
    (tmp_path / "open.obj").write_text(OPEN)
    for name in ("no.obj", "no.txt", "no.fmu"):
        (tmp_path / name).write_text("hello")
    (tmp_path / "bad.py").write_text("raise RuntimeError('no class here')")
    (tmp_path / "folder").mkdir()
    before = _names(tmp_path)
    arguments, fragments = BAD_INPUT[case]
    said = cli(*arguments)
    assert said.code == 2
    assert said.error.startswith("error: ")
    for fragment in fragments:
        assert fragment in said.error
    assert said.error_lines <= SCREEN
    assert "Traceback" not in said.error
    assert said.out == ""
    assert _names(tmp_path) == before
    assert _names(tmp_path / "folder") == []


@pytest.mark.parametrize(
    ("name", "fragment"),
    [
        ("drives_nothing", "cannot drive the body"),
        ("wants_heart_rate", "input 'heart_rate' that the body does not give"),
    ],
)
def test_an_fmu_that_does_not_fit_is_bad_input(
    cli: Cli, tmp_path: Path, fmu: Callable[[str], Path], name: str, fragment: str
) -> None:
    said = cli(*SMALL, "--controller", str(fmu(name)))
    assert said.code == 2
    assert fragment in said.error
    assert said.error_lines <= SCREEN
    assert _names(tmp_path) == []


@pytest.mark.parametrize("output", ["none/out.nc", "folder", "out.png"])
def test_a_bad_output_is_found_before_the_run(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, output: str
) -> None:
    def never(*_: object, **__: object) -> None:
        pytest.fail("the run was started")

    (tmp_path / "folder").mkdir()
    monkeypatch.setattr(run_command, "run", never)
    assert cli(*SMALL, "-o", output).code == 2


def test_a_picture_that_cannot_be_written_is_found_before_the_run(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "out.png").mkdir()
    said = cli(*SMALL)
    assert said.code == 2
    assert "out.png is a folder" in said.error
    assert _names(tmp_path) == ["out.png"]


def test_a_run_that_diverges_is_still_saved(cli: Cli, tmp_path: Path) -> None:
    unstable = ("--set", "integrator.method=symplectic-euler", "--set", "integrator.safety=3")
    said = cli(*SMALL, *unstable)
    assert said.code == 3
    for fragment in ("diverged at t = ", "volume", "Try "):
        assert fragment in said.error
    assert "Traceback" not in said.error
    assert _names(tmp_path) == ["out.nc", "out.png"]
    assert xr.load_dataset("out.nc").attrs["status"].startswith("failed: the body diverged")
    assert "no complete breath" in said.out


def test_a_controller_that_gives_nan_ends_the_run(cli: Cli, fmu: Callable[[str], Path]) -> None:
    said = cli(*SMALL, "--controller", str(fmu("gives_nan")))
    assert said.code == 3
    assert "controller.delta_p → body.delta_p carries nan" in said.error
    assert xr.load_dataset("out.nc").sizes["time"] == 16


def _python(*arguments: str, cwd: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "scenarios", *arguments],
        cwd=cwd,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("at", ["0 s", "0.5 s"])
def test_an_exception_in_a_controller_ends_a_real_process_in_order(
    tmp_path: Path, fmu: Callable[[str], Path], at: str
) -> None:
    stuck = ("--controller", str(fmu("stuck_valve")), "--set", f"controller.stuck_valve.at={at}")
    done = _python(*SMALL, *stuck, cwd=tmp_path)
    assert done.returncode == 3, done.stderr
    assert "the valve is stuck" in done.stderr
    assert "Traceback" not in done.stderr
    assert "Warning" not in done.stderr
    dataset = xr.load_dataset(tmp_path / "out.nc")
    assert dataset.attrs["status"].startswith("failed: ")
    assert dataset["time"][-1] == (0.0 if at == "0 s" else 0.5)
    assert (tmp_path / "out.png").exists()


def test_a_real_process_runs_and_leaves_no_folder_behind(tmp_path: Path) -> None:
    (tmp_path / "temporary").mkdir()
    done = _python(*SMALL, cwd=tmp_path, TMPDIR=str(tmp_path / "temporary"))
    assert (done.returncode, done.stderr) == (0, "")
    assert "wrote out.nc and out.png" in done.stdout
    assert _names(tmp_path / "temporary") == []


def test_an_interrupted_process_saves_what_it_has(
    tmp_path: Path, fmu: Callable[[str], Path]
) -> None:
    mark = tmp_path / "mark"
    # 10 242 points: all but 1e-4 of the time is spent in the body. In the controller's own Python
    # code the signal would count as a failure of the FMU.
    size = ["--set", "mesh.icosphere=5", "--cycles", "50", "--no-plot"]
    controller = ["--controller", str(fmu("marks_time"))]
    process = subprocess.Popen(
        [sys.executable, "-m", "scenarios", "run", "sphere-lung", *size, *controller],
        cwd=tmp_path,
        env={**os.environ, "SOFTBODY_TEST_MARK": str(mark)},
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60
    while not mark.exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130
    assert error == "error: interrupted\n"
    dataset = xr.load_dataset(tmp_path / "out.nc")
    assert dataset.attrs["status"] == "interrupted"
    assert dataset["time"][-1] >= 0.1 - 1e-9


def test_the_console_script_is_main() -> None:
    (script,) = entry_points(group="console_scripts", name="softbody")
    assert script.load() is softbody.main  # which looks for namesakes first
