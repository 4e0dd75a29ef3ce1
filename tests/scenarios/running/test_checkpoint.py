"""Checkpoints: a run that was killed goes on to the dataset of the unbroken one."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import scenarios
from cosim import ALGORITHMS, CouplingError
from cosim.controllers import build, controller_source
from scenarios import CheckpointError, Checkpoints, OutputError, Progress, RunError, Scenario
from scenarios.results.files import save
from scenarios.running import session
from scenarios.running.checkpoint import read
from scenarios.scene.parse import parse
from tests.cosim.helpers import with_extrapolation
from tests.scenarios.conftest import Cli


@pytest.fixture(scope="module")
def short(small: Scenario) -> Scenario:
    """A breath of one second of a sphere of 42 points."""
    return small.changed(
        {
            "mesh.icosphere": 1,
            "run.period": "1 s",
            "controller.paper.period": "1 s",
            "controller.paper.frames": 30,
        }
    )


class _Stop(Exception):
    """Nothing that the library knows."""


def stop_at(moment: float) -> Callable[[Progress], None]:
    def stop(progress: Progress) -> None:
        if progress.time > moment:
            raise _Stop

    return stop


def broken_and_resumed(scene: Scenario, path: Path, **options: Any) -> xr.Dataset:
    with pytest.raises(_Stop):
        scenarios.run(scene, checkpoints=Checkpoints(path, 7), progress=stop_at(0.5), **options)
    assert read(path).state.loop.index == 14  # 16/30 s were reached
    return scenarios.resume(path)


def assert_same(resumed: xr.Dataset, unbroken: xr.Dataset) -> None:
    """Every variable to the bit, and every attribute but the wall time."""
    assert set(resumed.variables) == set(unbroken.variables)
    for name, variable in unbroken.variables.items():
        assert resumed[name].dtype == variable.dtype
        assert resumed[name].to_numpy().tobytes() == variable.to_numpy().tobytes(), name
    xr.testing.assert_identical(
        resumed.assign_attrs(wall_time=0.0), unbroken.assign_attrs(wall_time=0.0)
    )


def test_a_run_that_was_killed_goes_on_to_the_bit(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "scenarios"]
    scene = ["sphere-lung", "--set", "mesh.icosphere=2", "--cycles", "2"]
    scene += ["--no-plot", "--quiet", "--positions", "1 s"]
    environment = {**os.environ, "PYTHONPATH": str(Path(scenarios.__file__).parents[1])}

    def softbody(*arguments: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen([*command, *arguments], cwd=tmp_path, env=environment)

    killed = softbody("run", *scene, "--checkpoint", "10")
    deadline = time.monotonic() + 60
    while not (tmp_path / "out.checkpoint").exists() and time.monotonic() < deadline:
        assert killed.poll() is None, "it ended before it could be killed"
        time.sleep(0.005)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert not (tmp_path / "out.nc").exists()
    assert softbody("resume", "out.checkpoint", "--no-plot", "--quiet").wait() == 0
    assert not (tmp_path / "out.checkpoint").exists()  # no longer needed
    assert softbody("run", *scene, "-o", "whole.nc").wait() == 0
    resumed, whole = (xr.load_dataset(tmp_path / name) for name in ("out.nc", "whole.nc"))
    assert_same(resumed, whole)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_every_algorithm_goes_on_to_the_bit(short: Scenario, name: str, tmp_path: Path) -> None:
    coupling = {"algorithm": name, "step": "1/30 s", **with_extrapolation(name, "quadratic")}
    scene = short.changed({"coupling": coupling})
    resumed = broken_and_resumed(scene, tmp_path / "a.checkpoint")
    assert_same(resumed, scenarios.run(scene))


@pytest.mark.parametrize(
    "changes",
    [
        {"integrator": {"method": "bdf2"}},
        {"integrator": {"method": "quasi-static"}},
        {"forces.surface_sph": {"gas_constant": "30 m^2/s^2", "viscosity": "1 Pa.s"}},
        pytest.param({"controller.isolation": "process"}, marks=pytest.mark.slow),
        {"controller.use": "pressure-support"},
        {"controller.use": "hysteresis"},
    ],
)
def test_what_has_a_memory_goes_on_to_the_bit(
    short: Scenario, changes: dict[str, Any], tmp_path: Path
) -> None:
    scene = short.changed(changes)
    resumed = broken_and_resumed(scene, tmp_path / "a.checkpoint", positions_every=0.1)
    assert_same(resumed, scenarios.run(scene, positions_every=0.1))


def test_a_scene_without_a_controller_goes_on_to_the_bit(short: Scenario, tmp_path: Path) -> None:
    data = tomllib.loads(short.text)
    del data["controller"]
    data["inputs"] = {"delta_p": "5 cmH2O"}
    scene = parse("free", tomli_w.dumps(data), tmp_path)
    resumed = broken_and_resumed(scene, tmp_path / "a.checkpoint")
    assert_same(resumed, scenarios.run(scene))


def test_a_controller_that_has_changed_is_refused(short: Scenario, tmp_path: Path) -> None:
    own = build(controller_source("paper"), tmp_path / "paper.fmu")
    path = tmp_path / "a.checkpoint"
    scene = short.changed({"controller.use": str(own)})
    assert_same(broken_and_resumed(scene, path), scenarios.run(scene))
    build(controller_source("pressure-control"), own)
    with pytest.raises(CheckpointError, match="is not the one that the checkpoint was written"):
        scenarios.resume(path)


def test_a_controller_that_cannot_be_written_down_is_named_before_the_run(
    short: Scenario, fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    reached: list[Progress] = []
    with pytest.raises(CouplingError, match="controller cannot write its state down"):
        scenarios.run(
            short,
            fmu("marks_time"),
            checkpoints=Checkpoints(tmp_path / "a.checkpoint", 1),
            progress=reached.append,
        )
    assert reached == []
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def whole(short: Scenario, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A checkpoint."""
    path = tmp_path_factory.mktemp("whole") / "a.checkpoint"
    scenarios.run(short, checkpoints=Checkpoints(path, 20))
    return path.read_bytes()


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(where=st.floats(0, 1, exclude_max=True), flip=st.integers(1, 255), cut=st.booleans())
def test_a_damaged_file_is_an_error_or_does_no_harm(
    whole: bytes, tmp_path: Path, where: float, flip: int, cut: bool
) -> None:
    path, place = tmp_path / "a.checkpoint", int(where * len(whole))
    spoilt = bytearray(whole)
    spoilt[place] ^= flip
    path.write_bytes(whole[:place] if cut else spoilt)
    try:
        spoilt_one = read(path)
    except CheckpointError:
        with pytest.raises(CheckpointError, match="damaged"):
            read(path)
    else:  # a byte that stands for nothing, such as a date
        path.write_bytes(whole)
        true = read(path)
        assert spoilt_one.state.loop == true.state.loop
        assert spoilt_one.provenance == true.provenance
        for name, values in true.state.arrays.items():
            np.testing.assert_array_equal(spoilt_one.state.arrays[name], values)


def test_what_is_no_checkpoint_is_refused(cli: Cli, tmp_path: Path) -> None:
    np.savez(tmp_path / "b.npz", a=[1.0])
    np.savez(tmp_path / "c.npz", header=np.array([{}], object))
    (tmp_path / "d.toml").write_text("title = 'x'")
    for name in ("b.npz", "c.npz", "d.toml"):
        said = cli("resume", name, "-o", "x.nc")
        assert said.code == 2
        assert f"checkpoint {name} cannot be read" in said.error
    said = cli("resume", "none.checkpoint")
    assert said.code == 2
    assert "does not exist; softbody run … --checkpoint N writes one" in said.error


def test_another_version_is_refused_and_other_libraries_are_told(
    short: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import scenarios.running.run as runner

    path = tmp_path / "a.checkpoint"
    with pytest.raises(_Stop):
        scenarios.run(short, checkpoints=Checkpoints(path, 10), progress=stop_at(0.5))
    now = runner.versions()
    monkeypatch.setattr(runner, "versions", lambda: {**now, "numpy": "99"})
    resumed = scenarios.resume(path)
    assert json.loads(resumed.attrs["versions"]) == now
    assert json.loads(resumed.attrs["resumed_with"])["numpy"] == "99"
    monkeypatch.setattr(runner, "versions", lambda: {**now, "softbody-cosim": "99"})
    with pytest.raises(CheckpointError, match="and this is 99; resume it with that version"):
        scenarios.resume(path)


def test_an_interrupted_run_keeps_its_checkpoint_and_its_data(
    cli: Cli, short: Scenario, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "short.toml").write_text(short.text)
    whole = scenarios.run(short)
    monkeypatch.setattr(session, "Progress", _interrupting(Progress))
    interrupted = cli("run", "short.toml", "--no-plot", "--checkpoint", "5")
    assert interrupted.code == 130
    assert "go on with: softbody resume out.checkpoint" in interrupted.out
    assert (tmp_path / "out.checkpoint").exists()
    assert xr.load_dataset("out.nc").sizes["time"] == 17
    monkeypatch.undo()
    os.chdir(tmp_path)
    (tmp_path / "stale.checkpoint").write_bytes((tmp_path / "out.checkpoint").read_bytes())
    save(whole, tmp_path / "stale.nc")
    stale = cli("resume", "stale.checkpoint", "--no-plot")
    assert stale.code == 2
    assert "output stale.nc holds a run that was completed since" in stale.error
    assert cli("resume", "out.checkpoint", "--no-plot").code == 0
    xr.testing.assert_equal(xr.load_dataset(tmp_path / "out.nc"), whole)


def _interrupting(kind: type[Progress]) -> Callable[..., Progress]:
    def made(time: float, *rest: Any) -> Progress:
        if time > 0.5:
            raise KeyboardInterrupt
        return kind(time, *rest)

    return made


def test_a_place_that_cannot_be_written_keeps_the_data(short: Scenario, tmp_path: Path) -> None:
    with pytest.raises(RunError, match="cannot be written") as caught:
        scenarios.run(short, checkpoints=Checkpoints(tmp_path / "no" / "a.checkpoint", 10))
    assert isinstance(caught.value.__cause__, OutputError)
    assert caught.value.dataset.sizes["time"] == 11


@pytest.mark.parametrize("every", ["0", "-3", "2.5", "many"])
def test_an_interval_that_is_none_is_refused(cli: Cli, every: str) -> None:
    said = cli("run", "sphere-lung", f"--checkpoint={every}")
    assert said.code == 2
    assert "expected a whole number" in said.error
