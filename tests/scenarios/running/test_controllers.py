"""Every controller that ships breathes with a body, at two communication steps."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr

import scenarios
from cosim.controllers import CONTROLLERS
from scenarios import breaths

REST = 2.5
"""L"""


@cache
def breathing(name: str, step: str = "1/30 s", cycles: int = 2) -> xr.Dataset:
    """Breaths of a sphere of 42 points."""
    changes = {"mesh.icosphere": 1, "run.cycles": cycles, "coupling.step": step}
    return scenarios.run(scenarios.load("sphere-lung", changes), controller=name)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_two_breaths_are_finite_and_of_a_sensible_size(name: str) -> None:
    dataset = breathing(name)
    assert dataset.attrs["status"] == "completed"
    assert all(np.isfinite(dataset[variable]).all() for variable in dataset.data_vars)
    volume = dataset["volume"]
    # Lungs of 2.5 L at rest: no collapse, and no more than a total capacity of 6.5 L.
    assert float(volume.min()) > 0.95 * REST
    assert float(volume.max()) < 6.5
    # From a quiet breath of 0.3 L to the vital capacity, and back to near where it began.
    last = breaths(dataset).isel(breath=-1)
    assert 0.3 < float(last["tidal_volume"]) < 3.5
    assert 0.0 <= float(last["residual_volume"]) < 0.6
    assert np.abs(dataset["flow"]).max() < 5.0


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTROLLERS)
def test_half_the_communication_step_gives_the_same_breaths(name: str) -> None:
    coarse = breathing(name)["volume"].to_numpy()[:121]
    fine = breathing(name, "1/60 s", 1)["volume"].to_numpy()[::2]
    # The controller acts at the same times, so what is left is the error of SDIRK2 at a frame. That
    # is below its tolerance, 1e-3 by default; 1e-4 of the range where it is not near it.
    assert np.abs(coarse - fine).max() < 2e-4 * np.ptp(coarse)


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize("scene", ["lung", "sphere-lung"])
def test_scenes_that_ship_have_parameters_for_it(scene: str, name: str) -> None:
    assert scenarios.load(scene, {"controller.use": name}).controller.parameters, (
        f"scenarios/library/{scene}.toml: expected a table [controller.{name}] with parameters "
        "that suit its body"
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_lung_breathes_with_it(name: str) -> None:
    lung = scenarios.load("lung", {"mesh.lung": "lung-right-770", "run.cycles": 2})
    dataset = scenarios.run(lung, controller=name)
    last = breaths(dataset).isel(breath=-1)
    assert float(dataset["volume"].min()) > 0.95 * 1.25
    assert 0.12 < float(last["tidal_volume"]) < 1.75
    assert 0.0 <= float(last["residual_volume"]) < 0.6
