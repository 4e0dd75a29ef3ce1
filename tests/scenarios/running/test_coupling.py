"""Coupling algorithms in scenarios: the same scene under all of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import scenarios
from cosim import ALGORITHMS, CouplingError, Iterated
from scenarios import RunError, Scenario, ScenarioError
from scenarios.studies.trade.settings import put_all
from tests.cosim.helpers import with_extrapolation


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


@pytest.mark.parametrize("extrapolation", ["constant", "quadratic"])
@pytest.mark.parametrize("name", [n for n, kind in ALGORITHMS.items() if kind().in_turn])
def test_a_sampled_controller_leaves_nothing_to_improve(
    short: Scenario, name: str, extrapolation: str
) -> None:
    """It acts at frames, on the volume at a frame: Gauss-Seidel is exact, and all others agree."""
    parts = ALGORITHMS[name].least_parts
    plain = scenarios.run(short.changed({"coupling.step": f"1/{30 * parts} s"}))
    other = {"algorithm": name, "step": "1/30 s", **with_extrapolation(name, extrapolation)}
    found = scenarios.run(short.changed({"coupling": other}))
    every = plain["volume"].to_numpy()[::parts]
    if parts > 1:  # the times of parts are rounded another way: i·h/2 and i·h + h/2
        np.testing.assert_allclose(found["volume"], every, rtol=1e-9)
    else:
        np.testing.assert_array_equal(found["volume"], every)


def test_an_algorithm_has_its_own_options(short: Scenario) -> None:
    given = {"algorithm": "iterated", "tolerance": 1e-4, "max_iterations": 7, "step": "1/30 s"}
    scene = short.changed({"coupling": given})
    assert scene.coupling.algorithm == Iterated(tolerance=1e-4, max_iterations=7)
    timed = {"algorithm": "event-locating", "tolerance": "1 ms", "step": "1/30 s"}
    algorithm: Any = short.changed({"coupling": timed}).coupling.algorithm
    assert algorithm.tolerance == 1e-3
    with pytest.raises(ScenarioError, match=r"coupling\.tolerance = 0\.001 has no unit"):
        scenarios.load("sphere-lung", {"coupling": {**timed, "tolerance": 1e-3}})


def test_a_trade_keeps_the_options_of_the_algorithm_that_they_are_for(short: Scenario) -> None:
    scene = short.changed({"coupling.algorithm": "iterated", "coupling.tolerance": 1e-4})
    kept, other = (put_all(scene, {"algorithm": name}) for name in ("iterated", "adaptive"))
    assert kept == scene
    assert other is not None
    assert other.coupling.algorithm == ALGORITHMS["adaptive"]()
    assert other.coupling.step == scene.coupling.step


def test_a_controller_that_cannot_go_back_is_named_before_the_run(
    short: Scenario, fmu: Any
) -> None:
    scene = short.changed({"coupling.algorithm": "adaptive"})
    with pytest.raises(CouplingError, match="controller cannot save and restore"):
        scenarios.run(scene, fmu("marks_time"))


def test_a_step_that_cannot_be_divided_far_enough_keeps_what_was_computed(short: Scenario) -> None:
    scene = short.changed(
        {
            "coupling": {
                "algorithm": "adaptive",
                "tolerance": 1e-9,
                "most_halvings": 1,
                "step": "1/30 s",
            }
        }
    )
    with pytest.raises(RunError, match=r"coupling\.tolerance") as caught:
        scenarios.run(scene)
    kept: xr.Dataset = caught.value.dataset
    assert kept.sizes["time"] >= 1
    assert np.isfinite(kept["volume"]).all()


def test_an_off_grid_switch_is_late_unless_it_is_located(short: Scenario) -> None:
    """The volume after a switch between two communication points, against steps of 1/3000 s."""
    ventilated = short.changed(
        {
            "controller.use": "pressure-control",
            "controller.pressure-control.rate": "60 1/min",
            "controller.pressure-control.inspiratory_time": "0.412 s",
            "integrator.tolerance": 1e-6,
        }
    )

    def volume(**coupling: Any) -> np.ndarray:
        scene = ventilated.changed({"coupling": {"step": "1/30 s", **coupling}})
        every = round(scene.steps / 30)
        return scenarios.run(scene)["volume"].to_numpy()[::every]

    true = volume(step="1/3000 s")
    late = np.abs(volume() - true).max()
    located = np.abs(volume(algorithm="event-locating", tolerance="0.1 ms") - true).max()
    # Held until the next point, the pressure acts 21 ms too long; 0.412 s is the 1236th of the
    # short steps, so the truth is late by none, and the event by 0.2 ms at the most.
    assert located < late / 50
