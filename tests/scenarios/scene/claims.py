"""What each scenario that ships has to show: one physical number of its own, or more.

A claim is a function that takes the dataset of a run and asserts. `CLAIMS` says which claim a
scenario makes; a variant makes that of its file, unless it has one of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
import xarray as xr

import scenarios
from scenarios import breaths, fit_compartment

Claim = Callable[[xr.Dataset], None]

DROPPED = {
    "mesh.ball": 150,
    "coupling.step": "5 ms",
    "run.period": "0.5 s",
    "integrator.method": "velocity-verlet",  # whose free fall is exact
}


@cache
def short_run(name: str) -> xr.Dataset:
    """One breath on a coarse mesh; of a body that falls, half a second."""
    scenario = scenarios.load(name)
    if scenario.obstacles:
        return scenarios.run(scenario.changed(DROPPED), positions_every=5e-3)
    changes: dict[str, object] = {"run.cycles": 1}
    if scenario.mesh.icosphere is not None:
        changes["mesh.icosphere"] = min(scenario.mesh.icosphere, 2)
    if scenario.mesh.lung is not None:
        changes |= {"mesh.lung": "lung-right-770", "forces.beta": 0}
    return scenarios.run(scenario.changed(changes))


def check_claim(name: str, dataset: xr.Dataset) -> None:
    """Assert what a scenario claims, or the file that it is a variant of."""
    families = [known for known in CLAIMS if name == known or name.startswith(f"{known}-")]
    if not families:
        pytest.fail(
            f"scenario {name} has no claim: write a function in tests/scenarios/scene/claims.py "
            "that asserts what a run of it has to show, such as its tidal volume, and name it in "
            f"CLAIMS there under {name!r}"
        )
    family = max(families, key=len)
    try:
        CLAIMS[family](dataset)
    except AssertionError as error:
        if family != name:
            error.add_note(
                f"{name} makes the claim of {family}. If it is to show something else, give it a "
                f"claim of its own in tests/scenarios/scene/claims.py, under {name!r} in CLAIMS"
            )
        raise


def _paper_breathes(dataset: xr.Dataset, vital_capacity: float) -> None:
    """Table 2: up to the sigmoid and back, and more than rest stays inside."""
    rest = float(dataset["volume"][0])
    upper = rest + vital_capacity * (1 - 1 / (1 + np.exp(20 / 5)))  # a + b, a from f(0) = rest
    residual = breaths(dataset)["residual_volume"] / vital_capacity
    assert ((residual > 0) & (residual < 0.6)).all()
    peak = breaths(dataset)["end_inspiratory_volume"]
    assert ((peak > rest + 0.75 * vital_capacity) & (peak < upper)).all()


def _lung(dataset: xr.Dataset) -> None:
    _paper_breathes(dataset, vital_capacity=1.75)


def _slack(dataset: xr.Dataset) -> None:
    """Table 3: gas is let out while exhaling, so the stiff lung is nearly empty half-way."""
    _lung(dataset)
    half_way = dataset["volume"].sel(time=3.0, method="nearest") - dataset["volume"][0]
    assert float(half_way) < 0.25 * 1.75  # a quarter of b, where f(P) would hold nine tenths


def _thermostat(dataset: xr.Dataset) -> None:
    """Figure 7: half-way through the exhalation, at P = 20 cmH2O, the lung still follows f(P)."""
    _lung(dataset)
    half_way = dataset.sel(time=3.0, method="nearest")
    # The flow lags behind by the shortfall that opens the gas, at most the band of 0.5 L.
    assert 0 < float(half_way["target_volume"] - half_way["volume"]) < 0.5


def _sphere_lung(dataset: xr.Dataset) -> None:
    _paper_breathes(dataset, vital_capacity=3.5)
    # α = 1 with R_aw = 10 cmH2O.s/L leaves 1 to 15 % of b behind.
    residual = breaths(dataset)["residual_volume"] / 3.5
    assert ((residual > 0.01) & (residual < 0.15)).all()


def _sphere_lung_membrane(dataset: xr.Dataset) -> None:
    _paper_breathes(dataset, vital_capacity=3.5)
    # p = Y/((1 − ν) R₀) (s − 1/s), in every frame: the sphere is never far from equilibrium.
    litres = dataset["volume"].to_numpy()
    stretch, radius = np.cbrt(litres / litres[0]), np.cbrt(3e-3 * litres[0] / (4 * np.pi))
    recoil = 433 / (1 - 0.3333) / radius * (stretch - 1 / stretch) / 98.0665
    error = np.abs(dataset["alveolar_pressure"] - recoil) / recoil.max()
    # 642 points are within 0.1 %, and 162 within 0.4 %; 1.1 % is inertia, as a phase begins
    assert error.max() < 0.012
    assert error.median() < 0.004


def _lung_bending(dataset: xr.Dataset) -> None:
    """What keeps a lung from closing is wrinkles, and those cost bending."""
    unbent = float(breaths(short_run("lung"))["residual_volume"][0])
    assert (breaths(dataset)["residual_volume"] < 0.4 * unbent).all()
    assert (breaths(dataset)["tidal_volume"] > 0.75 * 1.75).all()


def _pressure_control(dataset: xr.Dataset) -> None:
    inhaling = dataset["phase"][1:] == 1
    # N = 0, so the wall feels the ventilator alone: PEEP, and the driving pressure above it.
    expected = xr.where(inhaling, 20.0, 5.0)
    np.testing.assert_allclose(dataset["pressure"][1:], expected, rtol=1e-14)
    assert int(inhaling.sum()) % 45 == 0  # 1.5 s of 1/30 s in each breath
    # PEEP keeps the lung open: well above rest, and the breath goes in and out of that.
    assert (breaths(dataset)["residual_volume"] > 0.1).all()
    assert (breaths(dataset)["tidal_volume"] > 0.1).all()


def _dropped(dataset: xr.Dataset) -> None:
    """Until it meets the rim, gravity moves the centre, whatever springs, gas and fluid do."""
    time, height = dataset["snapshot_time"], dataset["position"][:, :, 2]
    fallen = height[0].mean() - 9.80665 / 2 * time**2
    off = np.abs(height.mean("point") - fallen)[time < 0.05]
    # Symplectic Euler, with which it ships, is late by half a step of 0.25 ms.
    exact = "VelocityVerlet" in dataset.attrs["integrator"]
    assert off.max() < (1e-14 if exact else 9.80665 * 0.05 * 0.26e-3 / 2)
    # It lands in the bowl: above its bottom at all times, and below its rim in the end.
    assert (dataset["clearance"] > 0).all()
    assert height.min() > 0.095
    assert 0.1 < height[-1].mean() < 0.205


def _pair(dataset: xr.Dataset) -> None:
    """Each lung shows the resistance that it lies behind; the ventilator's phases are theirs."""
    for name, resistance in (("left", 10), ("right", 20)):
        own = [key for key in dataset.variables if str(key).startswith(f"{name}_")]
        alone = dataset[own].rename({key: str(key).removeprefix(f"{name}_") for key in own})
        # the tissue is no straight line, and has damping of its own: 1.7 % is measured
        assert fit_compartment(alone).resistance == pytest.approx(resistance, rel=0.04)
    np.testing.assert_array_equal(
        dataset["volume"], dataset["left_volume"] + dataset["right_volume"]
    )


def _pair_paper(dataset: xr.Dataset) -> None:
    _paper_breathes(dataset, vital_capacity=3.5)
    # The controller closes the gas when both together are full; the right one is not, by then.
    fullest = dataset.isel(time=int(np.argmax(dataset["volume"].to_numpy())))
    rest = dataset.isel(time=0)
    share = [
        float(fullest[f"{name}_volume"] / rest[f"{name}_volume"]) for name in ("left", "right")
    ]
    assert share[0] > share[1] > 1


CLAIMS: dict[str, Claim] = {
    "glass": _dropped,
    "lung": _lung,
    **dict.fromkeys([f"lung-beta-{letter}" for letter in "abcde"], _slack),
    "lung-bending": _lung_bending,
    "lung-pair": _pair,
    "lung-pair-paper": _pair_paper,
    "lung-pressure-control": _pressure_control,
    "lung-thermostat": _thermostat,
    "sphere-lung": _sphere_lung,
    "sphere-lung-membrane": _sphere_lung_membrane,
}
"""By scenario. A variant that is not here makes the claim of its file."""
