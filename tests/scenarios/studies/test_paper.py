"""The paper's figures, tables and statements, on reduced scenes; and how each of them fails."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.image import imread
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from rich.console import Console

import scenarios
from scenarios.commands import reproduce as command
from scenarios.commands.options import build_scenario
from scenarios.errors import OutputError, ScenarioError
from scenarios.results.bumpiness import bumpiness, normal_deviation
from scenarios.results.rendering import render as render_module
from scenarios.results.rendering.camera import Camera
from scenarios.results.rendering.render import Surface, linear, render
from scenarios.results.sigmoid import fit_limb, fit_sigmoid, limbs, sigmoid
from scenarios.running.progress import StudyProgress
from scenarios.studies.paper import lungs as lungs_module
from scenarios.studies.paper import scenes as scenes_module
from scenarios.studies.paper import strips
from scenarios.studies.paper.glass import BALL
from scenarios.studies.paper.lungs import LUNGS, bumpiness_after_breaths
from scenarios.studies.paper.scenes import (
    ALPHA,
    BETA,
    GLASS,
    STRIDES,
    THERMOSTAT,
    Scenes,
    weights_of,
)
from scenarios.studies.paper.statements import STATEMENTS, judge, markdown
from scenarios.studies.paper.strips import FRAMES, glass_strip
from scenarios.studies.paper.targets import TARGETS, choose_targets
from softbody_core import SurfaceMesh, fibonacci_sphere, icosphere, wine_glass
from tests.scenarios.conftest import Cli

QUICK = ["mesh.lung=lung-right-770", "forces.beta=0"]
SETTINGS = [part for change in QUICK for part in ("--set", change)] + ["--cycles", "1"]

SHORT = ["run.period=0.1 s"]

PAPER = """
1,A,1,0,1,1
1,B,1,1,1,1
1,C,1,2,1,1
1,D,1,0,5,1
1,E,1,2,5,1
1,F,1,1,0,1
2,A,0.25,1,1,0.1
2,B,1,1,1,0.1
2,C,3,1,1,0.1
3,A,3,0.25,1,0.1
3,B,3,0.5,1,0.1
3,C,3,0.75,1,0.1
3,D,3,1,1,0.1
3,E,3,2,1,0.1
"""
"""Tables 1 to 3 of Mesit & Guha (2011): table, experiment, α, β, γ, δ."""


def _scenes(folder: Path, changes: Any = (), cycles: str | None = None, **options: Any) -> Scenes:
    return Scenes(folder, lambda name: build_scenario(name, changes, cycles), **options)


def _silent(progress: StudyProgress) -> None:
    """Told what goes on; says nothing."""


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds one breath of each lung of Table 2 and of Figure 7, on 770 points."""
    folder = tmp_path_factory.mktemp("quick")
    kept = _scenes(folder, QUICK, "1")
    for name in (*ALPHA.values(), THERMOSTAT):
        kept.get(name, _silent)
    assert kept.failures == {}
    return folder


@pytest.fixture
def rough(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small pictures with much grain: in a hundredth of the time."""
    monkeypatch.setattr(strips, "_LUNG_VIEW", (140.0, 0.0, 60))
    monkeypatch.setattr(strips, "_GLASS_VIEW", (20.0, 8.0, 60))
    monkeypatch.setattr(render_module, "_SAMPLES", 4)
    monkeypatch.setattr(render_module, "_SAMPLES_THROUGH_GLASS", 4)


# Bumpiness


def _bumpy(mesh: SurfaceMesh, height: float, seed: int = 0) -> NDArray[np.float64]:
    """Points of a sphere about the origin, each moved along the normal by a share of an edge."""
    edge = mesh.edge_lengths.mean()
    moves = height * edge * np.random.default_rng(seed).normal(size=(len(mesh.points), 1))
    radii = np.linalg.norm(mesh.points, axis=1, keepdims=True)
    return np.asarray(mesh.points * (1 + moves / radii))


@settings(max_examples=20)
@given(
    factor=st.floats(1e-3, 1e3),
    angle=st.floats(0, 6.3),
    shift=st.tuples(*[st.floats(-10, 10)] * 3),
)
def test_bumpiness_does_not_change_when_a_surface_is_moved_turned_or_scaled(
    factor: float, angle: float, shift: tuple[float, float, float]
) -> None:
    mesh = icosphere(1)
    points = _bumpy(mesh, 0.2)
    c, s = np.cos(angle), np.sin(angle)
    turned = points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) * factor + factor * np.array(
        shift
    )
    # roundings of positions up to ten radii from the origin
    assert bumpiness(turned, mesh.triangles) == pytest.approx(
        bumpiness(points, mesh.triangles), rel=1e-9
    )


def test_bumpiness_grows_in_proportion_to_bumps() -> None:
    mesh = icosphere(3)
    own = normal_deviation(mesh.points, mesh.triangles)
    small, large = (
        np.sqrt(np.mean((normal_deviation(_bumpy(mesh, h), mesh.triangles) - own) ** 2))
        for h in (0.05, 0.1)
    )
    # The filter is linear and the bumps are the same ones: what is left is second order.
    assert large == pytest.approx(2 * small, rel=0.02)
    # Uncorrelated moves of 0.05 edges: most of them is in waves that the filter takes out.
    assert 0.04 < small < 0.05


def test_a_shape_is_no_bump_and_a_body_at_rest_has_none() -> None:
    mesh = icosphere(3)
    egg = mesh.points * [1.0, 1.3, 0.8]
    # a wave as long as the body, of 30 % of its radius: three edges high
    assert bumpiness(egg, mesh.triangles) < 0.05
    assert bumpiness(egg, mesh.triangles, egg) == 0.0
    assert bumpiness(_bumpy(mesh, 0.2), mesh.triangles, mesh.points) > 0.1


def test_a_single_bump_is_found_where_it_is_and_outward_is_positive() -> None:
    mesh = icosphere(3)
    points = mesh.points.copy()
    points[5] *= 1.05
    apart = normal_deviation(points, mesh.triangles)
    assert int(np.argmax(np.abs(apart))) == 5
    assert apart[5] > 0


# The sigmoid


@settings(max_examples=30)
@given(a=st.floats(0.5, 2), b=st.floats(0.5, 4), c=st.floats(10, 30), d=st.floats(2, 6))
def test_a_sigmoid_is_found_again(a: float, b: float, c: float, d: float) -> None:
    pressure = np.linspace(0, 40, 60)
    fit = fit_sigmoid(pressure, sigmoid(pressure, a, b, c, d))
    # least squares without noise ends at its tolerance of 1e-8 in the cost, so 1e-4 in the values
    assert_allclose(list(fit.values.values()), [a, b, c, d], rtol=1e-3)
    assert fit.r_squared > 1 - 1e-8
    assert fit.has_inflection


def test_standard_errors_are_those_of_repeated_measurements() -> None:
    pressure, truth = np.linspace(0, 40, 60), np.array([1.2, 1.7, 20.0, 5.0])
    generator = np.random.default_rng(1998)
    fits = [
        fit_sigmoid(pressure, sigmoid(pressure, *truth) + 0.02 * generator.normal(size=60))
        for _ in range(200)
    ]
    values = np.array([list(fit.values.values()) for fit in fits])
    said = np.mean([list(fit.errors.values()) for fit in fits], axis=0)
    # a standard deviation of 200 samples is known to 1/√400 = 5 %; three times that
    assert_allclose(values.std(axis=0), said, rtol=0.15)
    assert_allclose(values.mean(axis=0), truth, atol=4 * said.max() / np.sqrt(200))


def test_a_limb_that_bends_one_way_has_no_inflection() -> None:
    pressure = np.linspace(0, 40, 60)
    assert not fit_sigmoid(pressure, 1.5 + np.exp((pressure - 40) / 5)).has_inflection


@pytest.mark.parametrize(
    ("pressure", "volume"),
    [([], []), ([1, 2, 3, 4], [1, 2, 3, 4]), ([3] * 9, range(9)), (range(9), [2.5] * 9)],
)
def test_a_limb_that_says_too_little_is_refused(pressure: Any, volume: Any) -> None:
    with pytest.raises(ScenarioError, match="does not determine a sigmoid"):
        fit_sigmoid(list(pressure), list(volume))


def test_limbs_are_the_first_breath(sphere: xr.Dataset) -> None:
    seen = limbs(sphere)
    assert [limb.sizes["time"] for limb in seen.values()] == [60, 60]
    assert np.all(np.diff(seen["inflation"]["respiratory_pressure"]) > 0)
    assert np.all(np.diff(seen["deflation"]["respiratory_pressure"]) < 0)
    with pytest.raises(ScenarioError, match="no complete breath"):
        limbs(sphere.isel(time=slice(0, 30)))


# Pictures


def _pixels(path: Path) -> NDArray[np.float64]:
    return np.asarray(imread(path)[..., :3], dtype=float)


def test_a_picture_of_a_sphere_has_its_outline_on_white() -> None:
    mesh = icosphere(4)
    camera = Camera(30.0, 10.0, (0.0, 0.0, 0.0), 2.5, (100, 80))
    picture = render([Surface(mesh.points, mesh.triangles)], camera)
    assert picture.shape == (80, 100, 4)
    assert_allclose(picture[0, 0], [1, 1, 1, 0], atol=1e-12)
    pixel = camera.height / 80
    # π of the unit sphere, seen from 30 radii: 1/(1 − 1/30²); a rim of one pixel, half covered
    assert picture[..., 3].sum() * pixel**2 == pytest.approx(np.pi, rel=0.02)
    middle = picture[40, 50]
    assert middle[3] == 1
    assert middle[0] > middle[2]  # tissue is red
    # the lamp is to the upper left
    assert picture[25, 35, :3].sum() > picture[55, 65, :3].sum() + 0.1


def test_a_camera_holds_what_it_is_put_around() -> None:
    points = np.random.default_rng(0).normal(size=(50, 3)) * [1, 3, 2]
    camera = Camera.around(points, 70.0, -20.0, 90, margin=0.1)
    seen = (points - camera.target) @ camera.axes.T
    width = camera.height * camera.pixels[0] / camera.pixels[1]
    assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-15)
    assert np.ptp(seen[:, 1]) == pytest.approx(camera.height / 1.2, rel=1e-12)
    assert np.abs(seen[:, 0]).max() <= width / 2
    assert_allclose(seen[:, :2].max(axis=0), -seen[:, :2].min(axis=0), atol=1e-12)


def test_a_ball_is_seen_through_glass() -> None:
    mesh = icosphere(2)
    camera = Camera(0.0, 0.0, (0.0, 0.0, 0.0), 3.0, (40, 40))
    glass = Surface(1.3 * mesh.points, mesh.triangles, glass=True)
    inside = Surface(0.4 * mesh.points, mesh.triangles)
    empty, full = render([glass], camera), render([glass, inside], camera)
    red = np.s_[18:22, 18:22, 0]
    assert empty[red].mean() > 0.8
    blue_of_the_ball = full[18:22, 18:22, 2].mean()
    assert blue_of_the_ball < 0.7 * full[red].mean()


def test_points_have_their_own_colours() -> None:
    mesh = icosphere(3)
    colours = linear(np.where(mesh.points[:, 2:] > 0, [[0.9, 0.1, 0.1]], [[0.1, 0.1, 0.9]]))
    camera = Camera(0.0, 0.0, (0.0, 0.0, 0.0), 2.5, (30, 30))
    picture = render([Surface(mesh.points, mesh.triangles, colours)], camera)
    above, below = picture[9, 15], picture[21, 15]
    assert above[0] > 2 * above[2]
    assert below[2] > 2 * below[0]


def test_without_the_renderer_the_message_says_what_to_install(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    said = cli("reproduce", "figure-8", "-o", "out")
    assert said.code == 2
    assert 'pip install "softbody-cosim[render]"' in said.error
    assert list((tmp_path / "out").iterdir()) == []  # before any scene was run


# Targets


def test_the_scenes_have_the_paper_s_weights() -> None:
    tables = {"1": GLASS, "2": ALPHA, "3": BETA}
    rows = list(csv.reader(io.StringIO(PAPER.strip())))
    assert len(rows) == sum(map(len, tables.values()))
    for table, letter, *weights in rows:
        w = scenarios.load(tables[table][letter]).weights
        assert [w.alpha, w.beta, w.gamma, w.delta] == [float(x) for x in weights], (table, letter)


def test_every_figure_and_table_of_the_paper_can_be_asked_for() -> None:
    figures = [f"figure-{i}" for i in range(1, 13)]
    assert list(choose_targets(["all"])) == [*figures, "table-1", "table-2", "table-3"]
    assert list(choose_targets(["table-2", "figure-9", "figure-1"])) == [
        "figure-1",
        "figure-9",
        "table-2",
    ]
    needed = {scene for target in TARGETS.values() for scene in target.scenes}
    assert needed == set(STRIDES)
    assert {scene for s in STATEMENTS for scene in s.scenes} <= needed


def test_an_unknown_figure_is_told_its_neighbour(cli: Cli, tmp_path: Path) -> None:
    said = cli("reproduce", "figure-13", "-o", "out")
    assert (said.code, said.error_lines < 10) == (2, True)
    assert "no figure or table is named 'figure-13'; did you mean 'figure-3'?" in said.error
    assert not (tmp_path / "out").exists()


# The command


def _times(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("*.nc")}


def test_figure_11_and_table_2_from_the_command_line(
    cli: Cli, quick: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = _times(quick)

    def not_again(*_: object, **__: object) -> None:
        pytest.fail("a scene that is kept was run again")

    monkeypatch.setattr(scenes_module, "run", not_again)
    said = cli("reproduce", "figure-7", "figure-11", "table-2", "-o", str(quick), *SETTINGS)
    assert (said.code, said.error) == (0, "")
    assert "wrote figure-7, figure-11, table-2, statements" in said.out
    assert _times(quick) == before
    for name in ("figure-7", "figure-11"):
        picture = _pixels(quick / f"{name}.png")
        assert 0.5 < (picture.min(axis=-1) > 0.99).mean() < 0.99  # lines on white
    table = (quick / "table-2.md").read_text(encoding="utf-8").splitlines()
    assert [line.split("|")[1].strip() for line in table[2:]] == list("ABC")
    # what the coarse lungs say too: a softer lung keeps more
    kept = [float(line.split("|")[7]) for line in table[2:]]
    assert kept[0] > kept[1] > kept[2] > 0
    statements = (quick / "statements.md").read_text(encoding="utf-8")
    verdict = {
        line.split("|")[2].strip(): line.split("|")[4].strip()
        for line in statements.splitlines()
        if line.startswith("|")
    }
    assert statements.startswith("With other settings than the paper's: ")
    assert verdict["the larger α, the less volume stays, in every cycle"] == "yes"
    assert verdict["inflation follows f(P) with c = 20 cmH2O (lung-c)"] == "yes"
    assert verdict["α = 3 “deforms back to the original volume”"] == "no"


def test_a_kept_scene_is_run_again_if_it_would_come_out_otherwise(
    quick: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert _scenes(quick, QUICK, "1").look("lung-c") is not None
    assert _scenes(quick, [*QUICK, "forces.alpha=2"], "1").look("lung-c") is None
    assert _scenes(quick, QUICK, "2").look("lung-c") is None
    assert _scenes(quick, QUICK, "1", fresh=True).look("lung-c") is None
    assert _scenes(quick, QUICK, "1").look("lung-beta-a") is None
    assert _scenes(quick, ["mesh.icosphere=2"], "1").look("lung-c") is None  # is for another scene
    monkeypatch.setitem(STRIDES, "lung-c", 12)
    assert _scenes(quick, QUICK, "1").look("lung-c") is None
    monkeypatch.setitem(STRIDES, "lung-c", 6)
    monkeypatch.setattr(scenes_module, "versions", lambda: {"numpy": "0"})
    assert _scenes(quick, QUICK, "1").look("lung-c") is None


def test_a_broken_file_is_run_again(tmp_path: Path) -> None:
    (tmp_path / "lung-c.nc").write_bytes(b"half a file")
    scenes = _scenes(tmp_path, QUICK, "1")
    assert scenes.look("lung-c") is None


def test_the_strip_of_a_lung(quick: Path, tmp_path: Path, rough: None) -> None:
    kept = {"lung-a": xr.load_dataset(quick / "lung-a.nc")}
    path = tmp_path / "figure-8.png"
    TARGETS["figure-8"].write(kept, path)
    picture = _pixels(path)
    frames = np.array_split(picture, 6, axis=1)
    covered = [float((frame.max(axis=-1) - frame.min(axis=-1) > 0.1).mean()) for frame in frames]
    # the lung at the end of the inhalation looks larger than at its beginning; then it shrinks
    assert covered[0] < covered[1] < covered[2] > covered[4] > covered[5] > covered[0]


def test_bumpiness_rises_with_beta_and_is_drawn(tmp_path: Path, rough: None) -> None:
    kept = _scenes(tmp_path, ["mesh.lung=lung-right-770"], "1")
    scenes = [BETA[letter] for letter in "ACE"]
    bumps = [bumpiness_after_breaths(kept.get(name, _silent)) for name in scenes]
    assert bumps[0] < bumps[1] < bumps[2]
    path = tmp_path / "figure-12.png"
    strips.bumpiness_strip(scenes, "reduced")(kept.datasets, path)
    picture = _pixels(path)
    assert picture.shape[1] > 3 * 30
    assert (picture[..., 0] - picture[..., 2]).max() > 0.4  # the colour map's orange


def test_a_scene_that_fails_is_named_and_the_rest_goes_on(
    cli: Cli,
    quick: Path,
    tmp_path: Path,
    fmu: Callable[[str], Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In lung-b, and there alone, the controller's valve is stuck after half a second."""
    stuck = str(fmu("stuck_valve"))
    original = command.build_scenario

    def build(name: str, changes: Any, cycles: Any) -> scenarios.Scenario:
        scenario = original(name, changes, cycles)
        return scenario.changed({"controller.use": stuck}) if name == "lung-b" else scenario

    monkeypatch.setattr(command, "build_scenario", build)
    out = tmp_path / "out"
    out.mkdir()
    for name in ("lung-a", "lung-c", THERMOSTAT):
        (out / f"{name}.nc").write_bytes((quick / f"{name}.nc").read_bytes())
    said = cli("reproduce", "figure-7", "figure-11", "-o", str(out), *SETTINGS)
    assert said.code == 3
    assert "scene lung-b failed: " in said.error
    assert "the valve is stuck" in said.error
    assert "figure-11 is not written: without lung-b" in said.error
    assert (out / "figure-7.png").exists()
    assert not (out / "figure-11.png").exists()
    partial = xr.load_dataset(out / "lung-b.nc")  # what was computed is kept
    assert partial.attrs["status"].startswith("failed: ")
    assert partial.sizes["time"] == 16
    statements = (out / "statements.md").read_text(encoding="utf-8").splitlines()
    says = "α = 1 “still maintains some volume at the end of exhalation”"
    (line,) = (line for line in statements if says in line)
    assert "| lung-b failed: " in line
    assert line.endswith("| no |")


def test_a_setting_that_no_scene_takes_is_a_mistake(cli: Cli, tmp_path: Path) -> None:
    said = cli("reproduce", "figure-7", "-o", "out", "--set", "forces.alhpa=1")
    assert said.code == 2
    assert said.error.startswith("error: forces.alhpa is unknown")
    assert not (tmp_path / "out" / "statements.md").exists()


def test_a_setting_that_one_scene_does_not_take_is_named(cli: Cli, tmp_path: Path) -> None:
    quick = ["--set", "mesh.ball=100", "--set", "coupling.step=2 ms", "--set", "run.period=0.01 s"]
    said = cli("reproduce", "table-1", "figure-7", "-o", "out", *quick, "--quiet")
    assert said.code == 3
    assert "scene lung-c failed: mesh: expected exactly one of" in said.error
    assert "figure-7 is not written: without lung-c, lung-thermostat" in said.error


def test_a_run_that_is_too_short_for_a_figure_says_so(cli: Cli, tmp_path: Path) -> None:
    short = [
        "--set",
        "run.period=1 s",
        "--set",
        "forces.beta=0",
        "--set",
        "mesh.lung=lung-right-770",
    ]
    said = cli("reproduce", "figure-7", "-o", "out", *short, "--cycles", "1", "--quiet")
    assert (said.code, said.out) == (3, "")
    assert "figure-7 is not written: the run has no complete breath" in said.error
    statements = (tmp_path / "out" / "statements.md").read_text(encoding="utf-8")
    assert "cannot be measured: the run has no complete breath" in statements


def test_a_folder_that_cannot_be_written_is_named_before_anything_runs(
    cli: Cli, tmp_path: Path
) -> None:
    (tmp_path / "taken").write_text("mine")
    said = cli("reproduce", "table-2", "-o", "taken")
    assert said.code == 2
    assert "output taken is a file; name a folder" in said.error
    assert (tmp_path / "taken").read_text() == "mine"
    said = cli("reproduce", "table-2", "-o", "no/such/folder")
    assert said.code == 2
    assert "output no/such/folder cannot be written: No such file" in said.error
    said = cli("reproduce", "table-2", "-o", "/proc/reproduced")
    assert said.code == 2
    assert "output /proc/reproduced cannot be written" in said.error


def test_a_picture_that_cannot_be_written_is_named(cli: Cli, quick: Path, tmp_path: Path) -> None:
    for name in ALPHA.values():
        (tmp_path / f"{name}.nc").write_bytes((quick / f"{name}.nc").read_bytes())
    (tmp_path / "figure-11.png").mkdir()
    said = cli("reproduce", "figure-11", "-o", str(tmp_path), *SETTINGS)
    assert said.code == 2
    assert "cannot be written: Is a directory" in said.error  # a long path is wrapped before that


def test_a_dataset_that_cannot_be_written_ends_the_call(tmp_path: Path) -> None:
    (tmp_path / "lung-c.nc").mkdir()
    with pytest.raises(OutputError, match=r"lung-c\.nc cannot be written"):
        _scenes(tmp_path, [*QUICK, *SHORT], "1").get("lung-c", _silent)


def test_ctrl_c_keeps_what_was_computed(tmp_path: Path) -> None:
    def stop(at: StudyProgress) -> None:
        if at.done > 0.1:
            raise KeyboardInterrupt

    with pytest.raises(scenarios.RunError, match="interrupted"):
        _scenes(tmp_path, QUICK, "1").get("lung-c", stop)
    partial = xr.load_dataset(tmp_path / "lung-c.nc")
    assert partial.attrs["status"] == "interrupted"
    assert _scenes(tmp_path, QUICK, "1").look("lung-c") is None


# Statements: each says no when it should


def _glass_set(**changes: dict[str, Any]) -> dict[str, xr.Dataset]:
    """Made-up runs of which every statement of section 4 holds, but for `changes` by experiment."""
    mesh = _ball()
    rough = {"A": 0.0, "B": 0.05, "C": 0.1, "D": 0.02, "E": 0.03, "F": 0.1}
    kept = {"A": 0.8, "B": 0.8, "C": 0.8, "D": 1.2, "E": 1.2, "F": 0.2}
    toml = scenarios.load("sphere-lung").text
    made = {}
    for letter, scene in GLASS.items():
        own = {
            "rough": rough[letter],
            "kept": kept[letter],
            "clearance": 1e-4,
            "wall_time": 20.0,
            "moves": 0.0,
            "at": (0.0, 0.0, 0.13),
            **changes.get(letter, {}),
        }
        still = mesh.points * 0.03
        bumpy = _bumpy(mesh, own["rough"], seed=7) * 0.03 + own["at"]
        shapes = np.stack([still + np.array([0, 0, 0.24]), *[bumpy] * 3])
        shapes[-1] += own["moves"]
        time = np.arange(6001) * 5e-4
        kept_at = time[[0, 2000, 5950, 6000]]  # the last two 25 ms apart, as in the real runs
        made[scene] = xr.Dataset(
            {
                "position": (("snapshot", "point", "axis"), shapes),
                "triangles": (("triangle", "corner"), mesh.triangles),
                "volume": ("time", np.linspace(1.0, own["kept"], 6001)),
                "clearance": ("time", np.full(6001, own["clearance"])),
                "obstacle_points": (("wall", "axis"), _cup()[0]),
                "obstacle_triangles": (("face", "corner"), _cup()[1]),
            },
            coords={"time": time, "snapshot_time": ("snapshot", kept_at)},
            attrs={"wall_time": own["wall_time"], "scenario": toml, "scenario_name": scene},
        )
    return made


@cache
def _ball() -> SurfaceMesh:
    return fibonacci_sphere(1986)


def _cup() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    mesh = wine_glass(24)
    return mesh.points, mesh.triangles


def _no(verdicts: Any) -> set[int]:
    """Which of the statements do not hold."""
    return {i for i, verdict in enumerate(verdicts) if not verdict.measurement.holds}


@pytest.mark.parametrize(
    ("changes", "fails"),
    [
        ({}, set()),
        ({"D": {"at": (0.0, 0.0, 0.5)}}, {2}),
        ({"D": {"at": (0.1, 0.0, 0.13)}}, {2}),
        ({"D": {"at": (0.036, 0.0, 0.05)}}, {2}),  # beside the stem, under the bowl
        ({"D": {"at": (0.0, 0.0, 0.095 - 0.0048 + 0.03)}}, {2}),  # 4.8 mm below the bowl's floor
        ({"A": {"moves": 0.9e-3 / 3**0.5}}, {2}),  # 0.9 mm in 25 ms
        ({"A": {"moves": 2.1e-3 * 0.025 / 3**0.5}}, {2}),  # 2.1 mm/s along the diagonal
        ({"A": {"moves": 1.9e-3 * 0.025 / 3**0.5}}, set()),
        ({"F": {"clearance": -1.1e-3}}, {3}),
        ({"B": {"rough": 0.11}}, {4}),
        ({"D": {"kept": 0.79}}, {5}),
        ({"E": {"rough": 0.08}}, {6}),
        ({"F": {"kept": 0.6}}, {7}),
        ({"C": {"wall_time": 301.0}}, {8}),
    ],
)
def test_each_statement_on_the_ball_can_fail(changes: dict[str, Any], fails: set[int]) -> None:
    verdicts = judge(_glass_set(**changes), {})
    assert [verdict.statement for verdict in verdicts] == list(BALL)
    assert _no(verdicts) == fails


def test_a_ball_that_is_no_ball_of_the_paper_or_not_finite_is_found() -> None:
    made = _glass_set()
    made[GLASS["A"]] = made[GLASS["A"]].isel(triangle=slice(0, -1))
    made[GLASS["F"]]["position"][2] = np.nan
    assert {0, 1} <= _no(judge(made, {}))


def test_the_strip_of_a_ball_in_a_glass(tmp_path: Path, rough: None) -> None:
    path = tmp_path / "figure-1.png"
    glass_strip(GLASS["A"], "made up")(_glass_set(), path)
    frames = np.array_split(_pixels(path), len(FRAMES), axis=1)
    red = [(frame[..., 0] - frame[..., 2] > 0.1).mean() for frame in frames]
    assert min(red) > 0.01  # the ball is seen in each


def test_a_real_ball_in_a_real_glass_is_measured_and_drawn(tmp_path: Path, rough: None) -> None:
    """A hundred frames of a coarse one: it falls."""
    kept = _scenes(tmp_path, ["mesh.ball=100", "run.period=25 ms"])
    for name in GLASS.values():
        kept.get(name, _silent)
    assert kept.failures == {}
    verdicts = {v.statement.says: v.measurement for v in judge(kept.datasets, {})}
    assert verdicts["all six sets of parameters run"].holds
    assert verdicts["the glass is rigid: no point passes a wall"].holds
    rougher = "A “smooth surface”, B “undulating surface waves”, C “more”"
    too_short = "cannot be measured: the run has 100 frames; expected 1000 or more"
    assert verdicts[rougher] == (too_short, False)
    assert (
        "100 points" in verdicts["“1,986 surface points, 3,968 faces, and 5,952 springs”"].measured
    )
    path = tmp_path / "figure-1.png"
    TARGETS["figure-1"].write(kept.datasets, path)
    picture = _pixels(path)
    assert (picture[..., 0] - picture[..., 2] > 0.1).mean() > 0.01


def test_each_statement_on_the_lung_can_fail(quick: Path) -> None:
    lungs = {name: xr.load_dataset(quick / f"{name}.nc") for name in (*ALPHA.values(), THERMOSTAT)}
    names = [s.says for s in LUNGS if BETA["A"] not in s.scenes]

    def failing(**changed: xr.Dataset) -> set[str]:
        verdicts = judge({**lungs, **{k.replace("_", "-"): v for k, v in changed.items()}}, {})
        assert [v.statement.says for v in verdicts] == names
        return {v.statement.says for v in verdicts if not v.measurement.holds}

    literal, deflation, back = (
        "“+ΔP = 40/(number of frames for one respiratory cycle)”",
        "deflation follows f(P) with c = 10 cmH2O (lung-c)",
        "α = 3 “deforms back to the original volume”",
    )
    never = {literal, deflation, back}
    assert failing() == never
    a, c = lungs["lung-a"], lungs["lung-c"]
    swapped = failing(lung_a=c, lung_c=a) - never
    assert {s[:8] for s in swapped} == {"α = 3 gi", "the larg"}
    gas = c.assign(n=c["n"] + 1)
    assert failing(lung_c=gas) - never == {
        "N is at most N_inf = 70k while inhaling, and N_def = 100 while exhaling"
    }
    large = c.assign(volume=2 * c["volume"])
    assert any(s.startswith("“total lung capacity") for s in failing(lung_c=large))
    assert any("under control" in s for s in failing(lung_c=large))
    shut = c.assign(volume=c["volume"].where(c["time"] < 3.5, float(c["volume"][0])))
    assert back not in failing(lung_c=shut)
    assert any("still maintains" in s for s in failing(lung_b=shut))
    assert any("does not deform back" in s for s in failing(lung_a=shut))
    passive = failing(lung_thermostat=c) - never
    assert passive == {
        "deflation follows f(P) with c = 10 cmH2O (lung-thermostat, f(P) held in both phases)"
    }
    assert deflation not in failing(lung_c=lungs[THERMOSTAT])


def test_statements_need_their_scenes() -> None:
    assert judge({}, {}) == []
    assert len(STATEMENTS) == len(BALL) + len(LUNGS)


def test_no_statement_on_a_scene_that_failed_holds() -> None:
    made = _glass_set()
    del made[GLASS["C"]]
    reason = "diverged at [bold]|v| = inf[/bold]; " + 30 * "take a smaller step "
    verdicts = judge(made, {GLASS["C"]: ScenarioError(reason)})
    assert [verdict.statement for verdict in verdicts] == list(BALL)
    on_c = {i for i, statement in enumerate(BALL) if GLASS["C"] in statement.scenes}
    assert on_c == _no(verdicts)
    assert on_c == {1, 2, 3, 4, 5, 6, 8}  # all but the counts, of A, and the cloth, F
    for i in on_c:
        measured = verdicts[i].measurement.measured
        assert measured.startswith("glass-c failed: diverged at [bold]|v| = inf[/bold]; take a ")
        assert measured.endswith(" …")
        assert len(measured) < 120
    # a bar in the reason adds no column, and brackets are no style
    assert r"\|v\|" in markdown(verdicts)
    printed = Console(file=io.StringIO(), width=200)
    printed.print(command.table_of(verdicts))
    assert "[bold]|v| = inf[/bold]" in cast("io.StringIO", printed.file).getvalue()


def test_a_ball_of_one_snapshot_is_not_known_to_rest() -> None:
    short = {"snapshot": slice(0, 1), "time": slice(0, 50)}
    one = {name: dataset.isel(short) for name, dataset in _glass_set().items()}
    finding = judge(one, {})[2].measurement
    assert finding.measured.startswith("cannot be measured: the run has one snapshot; expected 2")
    assert not finding.holds


@pytest.mark.parametrize(("rise", "holds"), [(1e-4, True), (0.0, False), (-2e-4, False)])
def test_the_smallest_rise_of_bumpiness_is_told(
    rise: float, holds: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Five made-up runs of two breaths; in the second, β = 0.75 is above 0.5 by `rise`."""
    bumps = np.array([[0.01, 0.02, 0.03, 0.04, 0.05], [0.01, 0.02, 0.02 + rise, 0.04, 0.05]])
    monkeypatch.setattr(lungs_module, "bumpiness_after_breaths", lambda made: made.attrs["bumps"])
    made = {
        scene: xr.Dataset(
            attrs={
                "scenario": scenarios.load(scene).text,
                "scenario_name": scene,
                "bumps": bumps[:, i],
            }
        )
        for i, scene in enumerate(BETA.values())
    }
    ((_, finding),) = ((v.statement, v.measurement) for v in judge(made, {}))
    said = f"strictly rising in {1 + holds} of 2 breaths, the smallest rise is {rise:.4f}"
    assert finding.measured.endswith(said)
    assert finding.holds == holds


@pytest.mark.slow
def test_the_scenes_at_full_size_show_what_the_paper_says(tmp_path: Path) -> None:
    kept = Scenes(tmp_path)
    for name in STRIDES:
        kept.get(name, _silent)
    verdicts = judge(kept.datasets, kept.failures)
    assert [verdict.statement for verdict in verdicts] == list(STATEMENTS)
    # the three that docs/reproduce.md explains
    assert {v.statement.says for v in verdicts if not v.measurement.holds} == {
        "“+ΔP = 40/(number of frames for one respiratory cycle)”",
        "deflation follows f(P) with c = 10 cmH2O (lung-c)",
        "α = 3 “deforms back to the original volume”",
    }
    inflation = fit_limb(limbs(kept.datasets["lung-c"])["inflation"])
    assert inflation.r_squared > 0.9999
    assert weights_of(kept.datasets["lung-beta-e"]).beta == 2
