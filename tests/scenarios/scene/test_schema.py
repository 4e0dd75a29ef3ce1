from __future__ import annotations

import dataclasses
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

import scenarios
from cosim import ALGORITHMS, Jacobi
from scenarios import Scenario, ScenarioError
from scenarios.scene.parse import parse
from softbody_core import MassSpring, SurfaceSPH, VelocityVerlet
from tests.cosim.helpers import with_extrapolation

numbers = st.floats(min_value=1e-3, max_value=1e3)

CHANGES = st.fixed_dictionaries(
    {},
    optional={
        "title": st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20),
        "mesh.icosphere": st.integers(0, 5),
        "mesh.volume": numbers.map(lambda x: f"{x!r} L"),
        "body.mass": numbers.map(lambda x: f"{x!r} kg"),
        "forces.alpha": numbers,
        "forces.gamma": st.sampled_from([0, 1, 0.5]),
        "forces.mass_spring.stiffness": numbers.map(lambda x: f"{x!r} N/m"),
        "constraints.pinned_points.indices": st.lists(st.integers(0, 3), max_size=3),
        "controller.use": st.sampled_from(["paper", "pressure-control", "/a b/x.fmu"]),
        "controller.paper.frames": st.integers(2, 200),
        "integrator.tolerance": st.floats(min_value=1e-9, max_value=1.0),
        "coupling": st.sampled_from(
            [
                {"step": "1/30 s", "algorithm": name, **with_extrapolation(name, degree)}
                for name in ALGORITHMS
                for degree in ("constant", "quadratic")
            ]
        ),
        "run.cycles": st.integers(1, 50),
    },
)


@given(changes=CHANGES)
@settings(deadline=None, max_examples=60)
def test_the_text_of_a_changed_scenario_loads_to_an_equal_one(changes: dict[str, Any]) -> None:
    changed = scenarios.load("sphere-lung", changes)
    assert parse(changed.name, changed.text, changed.folder) == changed


@pytest.mark.parametrize("name", scenarios.names())
def test_the_text_of_a_shipped_scenario_loads_to_an_equal_one(name: str) -> None:
    lung = scenarios.load(name)
    assert parse(lung.name, lung.text, lung.folder) == lung


@given(changes=CHANGES)
@settings(deadline=None, max_examples=30)
def test_a_change_can_be_made_on_loading_or_after_it(changes: dict[str, Any]) -> None:
    after = scenarios.load("sphere-lung").changed(changes)
    on_loading = scenarios.load("sphere-lung", changes)
    assert after.text == on_loading.text
    assert after == on_loading


def test_changes_arrive_where_they_belong() -> None:
    changes = {
        "title": "Small",
        "forces.alpha": 0.25,
        "forces.mass_spring.stiffness": "1 N/cm",
        "run.cycles": 2,
        "controller.paper.frames": 60,
        "coupling.algorithm": "jacobi",
        "constraints.pinned_points.indices": [0],
    }
    lung = scenarios.load("sphere-lung", changes)
    (springs,) = (law for law in lung.forces if isinstance(law, MassSpring))
    assert (lung.title, lung.weights.alpha, lung.run.cycles) == ("Small", 0.25, 2)
    assert springs.stiffness == 100.0
    assert lung.controller.parameters["frames"] == 60
    assert lung.coupling.algorithm == Jacobi()
    assert lung.constraints[0].indices == (0,)
    assert lung.steps == 240


def test_a_number_with_a_unit_can_be_changed_in_si_units_and_is_text_with_its_unit() -> None:
    glass = scenarios.load(
        "glass", {"obstacles.glass.motion": "free", "obstacles.glass.mass": "1 kg"}
    )
    changes = {
        "coupling.step": 0.5e-3,
        "body.mass": 1,
        "mesh.position": [0, 0.0, 0.25],
        "obstacles.glass.motion": "free",
        "obstacles.glass.mass": 2.5,
        "contact": {"thickness": 1e-3},
        "integrator": {"method": "symplectic-euler", "max_substep": 1e-4},
        "inputs.delta_p": np.float64(10.5),
    }
    changed = glass.changed(changes)
    assert (changed.coupling.step, changed.body.mass) == (0.5e-3, 1.0)
    assert changed.mesh.position == (0.0, 0.0, 0.25)
    assert changed.inputs.delta_p == 10.5
    text = tomllib.loads(changed.text)
    assert (text["coupling"]["step"], text["body"]["mass"]) == ("0.0005 s", "1 kg")
    assert text["mesh"]["position"] == ["0 m", "0.0 m", "0.25 m"]
    assert text["integrator"]["max_substep"] == "0.0001 s"
    assert parse(changed.name, changed.text, changed.folder) == changed
    assert glass.body.mass == 0.03  # and so are its tables
    assert glass.changed({}).text == glass.text


def test_several_bodies_can_be_changed_in_si_units() -> None:
    changes = {"forces.mass_spring.stiffness": 200.0, "bodies.left.mesh.volume": 1e-3}
    pair = scenarios.load("lung-pair").changed(changes)
    assert pair.bodies["left"].mesh.volume == 1e-3
    assert '"200.0 N/m"' in pair.text
    assert '"0.001 m^3"' in pair.text
    assert parse(pair.name, pair.text, pair.folder) == pair


def test_a_number_without_a_unit_is_refused_in_a_file_and_a_truth_value_everywhere() -> None:
    with pytest.raises(ScenarioError, match=r"body\.mass = 1 has no unit"):
        scenarios.load("lung", {"body.mass": 1})
    with pytest.raises(ScenarioError, match=r"body\.mass = True has no unit"):
        scenarios.load("lung").changed({"body.mass": True})
    with pytest.raises(ScenarioError, match=r"coupling\.step = 0 s: expected more than 0"):
        scenarios.load("lung").changed({"coupling.step": 0})


def test_numpy_numbers_can_be_changes() -> None:
    lung = scenarios.load("sphere-lung")
    swept = [lung.changed({"forces.alpha": alpha}).weights.alpha for alpha in np.arange(0.5, 2, 1)]
    assert swept == [0.5, 1.5]
    assert lung.changed({"run.cycles": np.int64(2)}).run.cycles == 2


def test_a_scenario_is_frozen() -> None:
    lung = scenarios.load("sphere-lung")
    with pytest.raises(dataclasses.FrozenInstanceError):
        lung.title = "another"  # type: ignore[misc]


def test_without_an_integrator_velocity_verlet_is_used() -> None:
    data = _data()
    del data["integrator"]
    assert _parsed(data).integrator == VelocityVerlet()


def test_a_force_that_is_not_named_is_not_there() -> None:
    lung = scenarios.load("sphere-lung")
    assert not any(isinstance(law, SurfaceSPH) for law in lung.forces)


def test_the_controller_takes_the_parameters_under_its_own_name() -> None:
    lung = scenarios.load("lung")
    assert lung.controller.parameters["vital_capacity"] == "1.75 L"
    other = lung.changed({"controller.use": "pressure-control"})
    assert other.controller.parameters["peep"] == "5 cmH2O"
    assert lung.changed({"controller.use": "use.fmu"}).controller.parameters == {}


def test_a_variant_is_its_file_with_its_changes() -> None:
    soft, stiff = scenarios.load("lung-a"), scenarios.load("lung-c")
    assert (soft.weights.alpha, stiff.weights.alpha) == (0.25, 3.0)
    assert soft.title != stiff.title
    assert dataclasses.replace(soft, name=stiff.name, title=stiff.title, weights=stiff.weights) == (
        stiff
    )


def test_further_changes_come_after_those_of_a_variant() -> None:
    assert scenarios.load("lung-a", {"forces.alpha": 0.5}).weights.alpha == 0.5


@pytest.mark.parametrize(
    ("changes", "fragments"),
    [
        ({"forces.alhpa": 1.0}, ["forces.alhpa is unknown", "did you mean 'alpha'?"]),
        ({"bodi.mass": "1 kg"}, ["bodi is unknown", "did you mean 'body'?"]),
        ({"body.mas": "1 kg"}, ["body.mas is unknown", "did you mean 'mass'?"]),
        (
            {"forces.mass_spring.stifness": "1 N/m"},
            ["forces.mass_spring.stifness is unknown", "did you mean 'stiffness'?"],
        ),
        ({"forces.mass_springs.damping": "1"}, ["forces.mass_springs is unknown", "'mass_spring'"]),
        (
            {"constraints.pined_top.share": 0.1},
            ["constraints.pined_top is unknown", "'pinned_top'"],
        ),
        ({"integrator.method": "sdirk3"}, ["integrator.method = 'sdirk3'", "'sdirk2'"]),
        ({"integrator.safety": 0.5}, ["integrator.safety is unknown", "tolerance"]),
        ({"coupling.algorithm": "jacoby"}, ["coupling.algorithm = 'jacoby'", "'jacobi'"]),
        ({"coupling.algorithm": 3}, ["coupling.algorithm = 3"]),
        ({"coupling.tolerance": 1e-3}, ["coupling.tolerance is unknown", "extrapolation"]),
        (
            {"coupling.algorithm": "iterated", "coupling.tolerance": 0},
            ["coupling.tolerance = 0", "more than 0"],
        ),
        ({"coupling.extrapolation": "cubic"}, ["coupling.extrapolation = 'cubic'"]),
        ({"mesh.lung": "lung-right-770"}, ["mesh: expected exactly one", "got lung, icosphere"]),
        ({"mesh.file": "a.obj"}, ["mesh: expected exactly one", "got file, icosphere"]),
        ({"forces.alpha": 0}, ["forces.alpha = 0", "more than 0"]),
        ({"forces.gamma": -0.5}, ["forces.gamma = -0.5", "at least 0"]),
        ({"body.mass": 1}, ["body.mass = 1 has no unit"]),
        ({"body.mass": "1 L"}, ["body.mass", "cannot be converted to 'kg'"]),
        ({"mesh.icosphere": "many"}, ["mesh.icosphere = 'many'", "a whole number"]),
        ({"forces": 3}, ["forces = 3", "table"]),
        ({"forces.mass_spring": 3}, ["forces.mass_spring = 3", "table"]),
        ({"constraints.pinned_top": 3}, ["constraints.pinned_top = 3", "table"]),
        ({"body.mass.of": 3}, ["body.mass = '1 kg'", "table"]),
        ({"run.cycles": 0}, ["run.cycles = 0", "at least 1"]),
        ({"coupling.step": "0.3 s"}, ["coupling.step = 0.3 s does not divide the run of 20 s"]),
        ({"coupling.step": "0 s"}, ["coupling.step = 0 s", "more than 0"]),
        ({"coupling.step": "30 s"}, ["coupling.step = 30 s does not divide"]),
        ({"controller.use": 3}, ["controller.use = 3"]),
        ({"controller.paper": 3}, ["controller.paper = 3", "table"]),
        ({"controller.paper.band": [1]}, ["controller.paper.band = [1]", "single value"]),
    ],
)
def test_a_bad_value_is_named_by_its_path(changes: dict[str, Any], fragments: list[str]) -> None:
    with pytest.raises(ScenarioError) as caught:
        scenarios.load("sphere-lung", changes)
    for fragment in fragments:
        assert fragment in str(caught.value)


def test_a_scene_has_a_controller_or_inputs_that_are_held() -> None:
    data = _data()
    with pytest.raises(ScenarioError, match="got both"):
        _parsed({**data, "inputs": {"n": 100}})
    del data["controller"]
    with pytest.raises(ScenarioError, match="got neither"):
        _parsed(data)
    assert _parsed({**data, "inputs": {"n": 100}}).inputs.n == 100


@pytest.mark.parametrize("name", ["mesh", "body", "forces", "coupling", "run"])
def test_a_missing_table_is_named(name: str) -> None:
    data = _data()
    del data[name]
    with pytest.raises(ScenarioError, match=rf"\[{name}\] is missing"):
        _parsed(data)


@pytest.mark.parametrize(
    ("table", "key", "fragment"),
    [
        ("body", "mass", "body.mass is missing"),
        ("run", "period", "run.period is missing"),
        ("coupling", "step", "coupling.step is missing"),
        ("controller", "use", "controller.use = None"),
        ("integrator", "method", "integrator.method = None"),
        ("mesh", "icosphere", "got none"),
        ("mesh", "volume", "mesh.volume is missing"),
    ],
)
def test_a_missing_key_is_named(table: str, key: str, fragment: str) -> None:
    data = _data()
    del data[table][key]
    if table == "integrator":
        data[table]["tolerance"] = 1e-3
    with pytest.raises(ScenarioError) as caught:
        _parsed(data)
    assert fragment in str(caught.value)


def test_broken_toml_says_where() -> None:
    with pytest.raises(ScenarioError, match=r"scenario x is no valid TOML: .*line 2"):
        parse("x", "[mesh]\nball = = 3", Path())


def test_variants_must_be_tables() -> None:
    with pytest.raises(ScenarioError, match=r"variants\.a = 3: expected a table"):
        parse("x", "[variants]\na = 3", Path())


def _data() -> dict[str, Any]:
    return tomllib.loads(scenarios.load("sphere-lung").text)


def _parsed(data: dict[str, Any]) -> Scenario:
    return parse("x", tomli_w.dumps(data), Path())
