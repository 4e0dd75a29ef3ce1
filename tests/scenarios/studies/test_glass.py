"""Table 1 of the paper on small meshes, and obstacles in scenarios and datasets."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import igl
import numpy as np
import pytest
import trimesh
import xarray as xr

import scenarios
from scenarios import RunError, ScenarioError
from scenarios.results.bumpiness import bumpiness
from scenarios.running.assemble import build_body
from softbody_core import Contact, RigidBody, VolumeCap, WeightCourse, WeightRatio

SMALL = {"mesh.ball": 200, "coupling.step": "2 ms", "run.period": "1.2 s"}
LETTERS = "abcdef"


@cache
def _run(letter: str) -> xr.Dataset:
    return scenarios.run(scenarios.load(f"glass-{letter}", SMALL), positions_every=0.1)


def _roughness(letter: str) -> float:
    """Mean bumpiness above that at rest, after landing (0.3 s)."""
    dataset = _run(letter)
    triangles, shapes = dataset["triangles"].to_numpy(), dataset["position"].to_numpy()
    return float(np.mean([bumpiness(x, triangles, shapes[0]) for x in shapes[3:]]))


def _kept(letter: str) -> float:
    volume = _run(letter)["volume"]
    return float(volume[-1] / volume[0])


@pytest.mark.parametrize("letter", LETTERS)
def test_no_point_is_ever_within_the_glass(letter: str) -> None:
    dataset = _run(letter)
    assert dataset.attrs["status"] == "completed"
    assert np.isfinite(dataset["position"]).all()
    assert (dataset["clearance"] > 0).all()
    wall, triangles = (
        dataset["obstacle_points"].to_numpy(),
        dataset["obstacle_triangles"].to_numpy(),
    )
    for points in dataset["position"].to_numpy():
        # the solid angle that the glass fills, seen from each point: not how the core knows
        assert (np.abs(igl.winding_number(wall, triangles, points)) < 0.5).all()


@pytest.mark.parametrize("letter", "abcde")
def test_with_gas_the_ball_rests_in_the_bowl(letter: str) -> None:
    positions = _run(letter)["position"].to_numpy()
    centres = positions.mean(axis=1)
    assert np.hypot(*positions[-1, :, :2].T).max() < 0.0405  # the bowl's largest radius
    assert positions[-1, :, 2].min() > 0.095  # its bottom
    assert positions[-1, :, 2].max() < 0.205  # its rim
    # it fell 13 cm; in the last 0.1 s of 1.2 s its centre moves by less than a hundredth of that
    assert np.linalg.norm(centres[-1] - centres[-2]) < 1.3e-3


def test_more_fluid_makes_a_rougher_ball_but_not_under_high_pressure() -> None:
    a, b, c, d, e = (_roughness(letter) for letter in "abcde")
    assert a < b < c
    assert abs(e - d) < abs(c - a) / 4


def test_high_pressure_keeps_more_volume() -> None:
    assert min(_kept("d"), _kept("e")) > max(_kept("a"), _kept("b"), _kept("c"))


def test_without_pressure_alone_volume_is_lost() -> None:
    assert _kept("f") < 1 < min(_kept(letter) for letter in "abcde")


@pytest.mark.slow
def test_a_fine_ball_without_pressure_loses_most_of_its_volume() -> None:
    """A net of 200 points is a stiff dome still; the paper's of 1,986 falls in."""
    changes = {"coupling.step": "1 ms", "run.period": "0.6 s"}
    volume = scenarios.run(scenarios.load("glass-f", changes))["volume"]
    assert float(volume[-1] / volume[0]) < 0.5


# Datasets


def test_a_glass_that_stands_is_kept_once() -> None:
    dataset = _run("a")
    assert dataset["obstacle_points"].dims == ("obstacle_point", "axis")
    assert dataset["obstacle_triangles"].dims == ("obstacle_triangle", "corner")
    obstacle = build_body(scenarios.load("glass-a", SMALL)).model.obstacles[0]
    # seen from its centre and back: rounding
    np.testing.assert_allclose(dataset["obstacle_points"], obstacle.mesh.points, atol=1e-15)
    np.testing.assert_array_equal(dataset["obstacle_triangles"], obstacle.mesh.triangles)
    assert dataset["clearance"].attrs["units"] == "m"
    assert not [name for name in dataset if str(name).endswith("_position")]


HAMMER: dict[str, Any] = {
    "mesh.ball": 60,
    "coupling.step": "5 ms",
    "run.period": "50 ms",
    "obstacles.hammer": {
        "mesh": {"icosphere": 1, "volume": "10 mL", "position": ["0.1 m", "0 m", "0.235 m"]},
        "motion": "free",
        "mass": "20 g",
        "velocity": ["-1 m/s", "0 m/s", "0 m/s"],
    },
}


def test_an_obstacle_that_moves_is_kept_at_each_snapshot() -> None:
    dataset = scenarios.run(scenarios.load("glass", HAMMER), positions_every=0.01)
    assert dataset["obstacle_points"].dims == ("snapshot", "obstacle_point", "axis")
    assert dataset["obstacle_triangles"].to_numpy().max() == dataset.sizes["obstacle_point"] - 1
    place = dataset["hammer_position"]
    assert (place.dims, place.attrs["units"]) == (("time", "axis"), "m")
    assert "glass_position" not in dataset
    # nothing is met yet: free flight
    np.testing.assert_allclose(place[:, 0], 0.1 - dataset["time"], atol=1e-12)
    np.testing.assert_allclose(place[:, 2], 0.235 - 9.80665 / 2 * dataset["time"] ** 2, atol=1e-12)
    hammer = dataset["obstacle_points"].to_numpy()[:, -42:]
    np.testing.assert_allclose(hammer.mean(axis=1), place[::2], atol=1e-12)


def test_a_scene_without_obstacles_has_none_of_this() -> None:
    changes = {"mesh.icosphere": 1, "run.cycles": 1, "run.period": "0.2 s"}
    dataset = scenarios.run(scenarios.load("sphere-lung", changes), positions_every=0.1)
    assert {"clearance", "obstacle_points", "obstacle_triangles"}.isdisjoint(dataset.data_vars)


# What a scenario says


def test_a_scenario_builds_what_it_says() -> None:
    changes = {
        **HAMMER,
        "contact.friction": 0.7,
        "contact.thickness": "0.5 mm",
        "constraints.volume_cap.volume": "0.1 L",
        "constraints.weight_course": {"weight": "alpha", "times": ["0 s", "2 s"], "values": [1, 3]},
        "constraints.weight_ratio": {"weight": "beta", "to": "alpha", "ratio": 0.3},
    }
    scenario = scenarios.load("glass", changes)
    cap, course, ratio = scenario.constraints
    assert cap == VolumeCap(1e-4)
    assert course == WeightCourse("alpha", (0.0, 2.0), (1.0, 3.0))
    assert ratio == WeightRatio("beta", "alpha", 0.3)
    glass, hammer = build_body(scenario).model.obstacles
    assert isinstance(hammer, RigidBody)
    assert (glass.name, glass.motion, hammer.motion) == ("glass", "fixed", "free")
    assert (hammer.mass, hammer.velocity) == (0.02, (-1.0, 0.0, 0.0))
    assert hammer.mesh.volume == pytest.approx(1e-5, rel=1e-12)
    assert (scenario.contact.friction, scenario.contact.thickness) == (0.7, 5e-4)
    assert scenarios.scene.parse.parse("again", scenario.text, scenario.folder).constraints == (
        scenario.constraints
    )
    twice = [{"weight": name, "to": "alpha", "ratio": 0.5} for name in ("beta", "gamma")]
    several = scenarios.load("glass", {"constraints.weight_ratio": twice})
    assert [one.weight for one in several.constraints] == ["beta", "gamma"]
    body = build_body(scenario)
    body.step(0.005)
    body.step(0.005)
    assert body.model.weights.alpha == pytest.approx(1.005, rel=1e-12)
    assert body.model.weights.beta == 0.3 * body.model.weights.alpha


BALL = {"icosphere": 0, "volume": "1 mL"}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"controller.use": "paper"}, r"\[controller\], or a table \[inputs\].*got both"),
        ({"obstacles.rock": {"motion": "fixed"}}, "obstacles.rock.mesh is missing"),
        ({"obstacles.rock": {"mesh": BALL, "motion": "free"}}, "obstacles.rock.*mass is missing"),
        ({"obstacles.rock": {"mesh": BALL, "motion": "mad"}}, "obstacles.rock.motion = 'mad'"),
        ({"obstacles.rock": {"mesh": BALL, "colour": "red"}}, "obstacles.rock.colour is unknown"),
        ({"obstacles.rock": {"mesh": BALL, "name": "x"}}, "obstacles.rock.name is unknown"),
        ({"obstacles.rock": {"mesh": {}}}, "obstacles.rock.mesh: expected exactly one of"),
        ({"obstacles.rock": 3}, "obstacles.rock = 3: expected a table"),
        ({"obstacles.a/b": {"mesh": BALL}}, "obstacles.a/b: expected a name of small letters"),
        ({"obstacles.bounding_box_min": {"mesh": BALL}}, "none of the body's own variables"),
        (
            {"constraints.weight_course": {"weight": "alpha", "times": [0, 2], "values": [1, 3]}},
            r'constraints.weight_course.times\[0\] = 0 has no unit; write it like "0 s"',
        ),
        (
            {"obstacles.rock": {"mesh": BALL, "velocity": [1, 0, 0]}},
            r"obstacles.rock.velocity\[0\] = 1 has no unit",
        ),
        (
            {"obstacles.rock": {"mesh": BALL, "velocity": ["1 m/s", "0 m/s"]}},
            "obstacles.rock.velocity = .*: expected a list of 3",
        ),
        (
            {"obstacles.rock": {"mesh": BALL, "force": ["1 m/s", "0 N", "0 N"]}},
            r"obstacles.rock.force\[0\]",
        ),
        (
            {"obstacles.rock": {"mesh": BALL, "velocity": ["1 m/s", "0 m/s", "0 m/s"]}},
            'fixed and has a velocity; try motion = "driven"',
        ),
        ({"contact.bodies": []}, r"contact.bodies is unknown.*\[obstacles.NAME\]"),
        ({"contact.friction": -1}, "contact.friction = -1"),
        ({"contact.thickness": 1}, "contact.thickness = 1 has no unit"),
        ({"mesh.position": ["0 m", "0 m"]}, "mesh.position = .*: expected a list of 3"),
        (
            {"mesh.position": ["0 m", "0 m", "0.1 m"]},
            "points of the body are inside obstacle 'glass'",
        ),
        ({"integrator.method": "quasi-static", "forces.delta": 0}, "QuasiStatic neglects inertia"),
        ({"constraints.volume_cap.volume": "1 mL"}, "body at rest already encloses"),
        ({"constraints.volume_cap.volume": 1}, "constraints.volume_cap.volume = 1 has no unit"),
        ({"constraints.volume_cap": {}}, "constraints.volume_cap.volume is missing"),
        (
            {"constraints.weight_course": {"weight": "alpha", "times": ["0 s"], "values": [1, 2]}},
            "constraints.weight_course: .*1 times and 2 values",
        ),
        (
            {"constraints.weight_course": {"weight": "omega", "times": ["0 s"], "values": [1]}},
            "constraints.weight_course.weight = 'omega'",
        ),
        (
            {"constraints.weight_ratio": {"weight": "beta", "to": "beta", "ratio": 1}},
            "beta cannot follow itself",
        ),
        (
            {"constraints.weight_ratio": {"weight": "beta", "to": "alpha", "ratio": "2"}},
            "constraints.weight_ratio.ratio = '2'",
        ),
    ],
)
def test_a_scene_that_makes_no_sense_is_named(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(ScenarioError, match=said):
        build_body(scenarios.load("glass", {"mesh.ball": 60, **changes}))


def test_a_press_ends_a_run_with_a_name_and_the_data_so_far(tmp_path: Path) -> None:
    """A plate inside the ball closes on the one below it, with the ball's skin between."""
    for name, sides in (("table", (200, 200, 20)), ("plate", (20, 20, 2))):
        trimesh.creation.box(sides).export(tmp_path / f"{name}.ply")

    def box(name: str, height: str) -> dict[str, Any]:
        place = ["0 m", "0 m", height]
        return {"file": str(tmp_path / f"{name}.ply"), "unit": "mm", "position": place}

    falling = {"motion": "driven", "velocity": ["0 m/s", "0 m/s", "-0.5 m/s"]}
    changes = {
        "mesh": {"ball": 200, "volume": "24.43 mL", "position": ["0 m", "0 m", "0.02 m"]},
        "obstacles": {
            "plate": {"mesh": box("plate", "0.012 m"), **falling},
            "table": {"mesh": box("table", "-0.01 m")},
        },
        "coupling.step": "1 ms",
        "run.period": "0.1 s",
        "contact.thickness": "0.5 mm",
    }
    with pytest.raises(RunError, match="no place left between obstacles plate, table") as caught:
        scenarios.run(scenarios.load("glass", changes))
    assert caught.value.dataset.sizes["time"] > 3
    assert (caught.value.dataset["clearance"] > 0).all()


def test_a_far_contact_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    bound: list[Contact] = []
    original = Contact.bind

    def bind(self: Contact, *arguments: Any) -> Any:
        bound.append(self)
        return original(self, *arguments)

    monkeypatch.setattr(Contact, "bind", bind)
    build_body(scenarios.load("sphere-lung", {"mesh.icosphere": 1}))
    assert bound == []
