"""Several bodies in one scene: left and right lung under one controller."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import scenarios
from cosim import WiringError
from scenarios import Checkpoints, Scenario, ScenarioError
from scenarios.scene.parse import parse
from tests.scenarios.conftest import Cli

SPHERES = {
    "bodies.left.mesh": {"icosphere": 1, "volume": "1.25 L"},
    "bodies.right.mesh": {"icosphere": 1, "volume": "1.25 L"},
    "run.cycles": 1,
}


@pytest.fixture(scope="module")
def pair() -> Scenario:
    """Two spheres of 42 points, the right one behind twice the resistance."""
    return scenarios.load("lung-pair", SPHERES)


@pytest.fixture(scope="module")
def dataset(pair: Scenario) -> xr.Dataset:
    """Of one breath. Shared: do not change it."""
    return scenarios.run(pair, positions_every=1.0)


def alone(dataset: xr.Dataset, name: str) -> xr.Dataset:
    """What the dataset says of one body, under the names that a body alone has."""
    own = [key for key in dataset.variables if str(key).startswith(f"{name}_")]
    return dataset[own].rename({key: str(key).removeprefix(f"{name}_") for key in own})


def test_what_adds_up_is_the_sum(dataset: xr.Dataset) -> None:
    for name in ("volume", "flow", "bounding_box_volume"):
        total = dataset[f"left_{name}"] + dataset[f"right_{name}"]
        np.testing.assert_array_equal(dataset[name], total)
        assert dataset[name].attrs["units"] == dataset[f"left_{name}"].attrs["units"]
    assert dataset["volume"].attrs["long_name"] == "enclosed volume, all bodies"
    assert dataset["left_position"].shape == (5, 42, 3)


@pytest.mark.parametrize("name", ["left", "right"])
def test_each_lung_breathes_as_it_does_alone(
    pair: Scenario, dataset: xr.Dataset, name: str
) -> None:
    """This ventilator asks nothing of the lungs, so they do not feel each other."""
    single = scenarios.run(pair.bodies[name], positions_every=1.0)
    both = alone(dataset, name)
    for key in both.data_vars:
        np.testing.assert_array_equal(both[key], single[key], err_msg=str(key))
    np.testing.assert_array_equal(dataset["phase"], single["phase"])


def test_each_lung_shows_its_own_resistance(dataset: xr.Dataset) -> None:
    fits = {name: scenarios.fit_compartment(alone(dataset, name)) for name in ("left", "right")}
    # What the tissue's damping adds is a few per cent of 10 cmH2O.s/L; its recoil is no straight
    # line, which the fit of a line turns into some more.
    assert fits["left"].resistance == pytest.approx(10, rel=0.1)
    assert fits["right"].resistance == pytest.approx(20, rel=0.1)
    assert dataset["left_volume"].max() > dataset["right_volume"].max()


def test_the_controller_sees_the_volume_of_both(pair: Scenario) -> None:
    """Equal lungs under the paper's controller stay equal, and together reach its target."""
    equal = pair.changed(
        {
            "controller.use": "paper",
            "bodies.right.forces.airway_resistance.resistance": "10 cmH2O.s/L",
        }
    )
    breath = scenarios.run(equal)
    np.testing.assert_array_equal(breath["left_volume"], breath["right_volume"])
    top = float(scenarios.breaths(breath)["end_inspiratory_volume"][0])
    highest = float(breath["target_volume"].max())
    # Gas is let in until the volume is within the band of 0.5 L below f(P).
    assert highest - 0.5 < top < highest


def test_a_loop_over_both_is_independent_of_their_order(pair: Scenario) -> None:
    """With the paper's controller each feels the other through their sum."""
    paper = pair.changed({"controller.use": "paper"})
    data = tomllib.loads(paper.text)
    data["bodies"] = dict(reversed(data["bodies"].items()))
    import tomli_w

    swapped = parse("swapped", tomli_w.dumps(data), paper.folder)
    assert list(swapped.bodies) == ["right", "left"]
    one, other = scenarios.run(paper), scenarios.run(swapped)
    # The sum of two is the same both ways, to the bit.
    for name in ("volume", "left_volume", "right_volume", "n"):
        np.testing.assert_array_equal(one[name], other[name])


def test_bodies_go_on_from_a_checkpoint(
    pair: Scenario, dataset: xr.Dataset, tmp_path: Path
) -> None:
    path = tmp_path / "a.checkpoint"
    scenarios.run(pair, positions_every=1.0, checkpoints=Checkpoints(path, 50))
    resumed = scenarios.resume(path)  # from 100 of 120
    zero = {"wall_time": 0.0}
    xr.testing.assert_identical(resumed.assign_attrs(zero), dataset.assign_attrs(zero))


def test_values_are_shared_but_for_those_that_a_body_has(pair: Scenario) -> None:
    stiff = pair.changed(
        {"forces.mass_spring.stiffness": "900 N/m", "bodies.left.forces.alpha": 2.0}
    )
    left, right = stiff.bodies["left"], stiff.bodies["right"]
    assert [one.weights.alpha for one in (left, right)] == [2.0, 1.0]
    springs = {law for one in (left, right) for law in one.forces if hasattr(law, "stiffness")}
    assert [law.stiffness for law in springs] == [900.0]
    assert parse(stiff.name, stiff.text, stiff.folder) == stiff
    assert parse(left.name, left.text, left.folder) == left


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"bodies": {"left": {}}}, "bodies: expected two tables or more"),
        ({"bodies.left.forces.alhpa": 1.0}, r"bodies\.left: forces\.alhpa is unknown"),
        ({"bodies.left.coupling": {}}, r"bodies\.left\.coupling is unknown"),
        ({"bodies.controller": {}}, r"bodies\.controller: expected a name"),
        ({"bodies.Left": {}}, r"bodies\.Left: expected a name of small letters"),
        ({"bodies.left.mesh": {}}, r"bodies\.left: mesh: expected exactly one of lung"),
        ({"obstacles": {"wall": {}}}, "several bodies takes none"),
        ({"bodies.left": 3}, r"bodies\.left = 3: expected a table"),
    ],
)
def test_bodies_that_are_not_as_expected_are_refused(
    pair: Scenario, changes: dict[str, Any], said: str
) -> None:
    with pytest.raises(ScenarioError, match=said):
        pair.changed(changes)


def test_a_controller_that_needs_one_pressure_is_refused(pair: Scenario) -> None:
    """Pressures of two lungs do not add up."""
    with pytest.raises(WiringError, match="input 'alveolar_pressure' that the body does not give"):
        scenarios.run(pair, "pid")


def test_what_takes_one_body_says_so(cli: Cli) -> None:
    said = cli("trade", "lung-pair", "--axis", "points")
    assert said.code == 2
    assert "this scenario has 2 bodies: left, right" in said.error


def test_a_trade_takes_both(pair: Scenario) -> None:
    quick = pair.changed({"run.period": "0.5 s", "controller.pressure-control.rate": "30 1/min"})
    errors = scenarios.trade(quick, {"tolerance": (1e-2, 1e-4)})["error"]
    assert errors[0] > errors[1]
