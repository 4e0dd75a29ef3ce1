"""The coupled lung against closed forms and against what the paper reports."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import scenarios
from softbody_core import (
    SDIRK2,
    AirwayResistance,
    InternalPressure,
    MassSpring,
    SoftBody,
    SoftBodyModel,
    fibonacci_sphere,
    icosphere,
)

CMH2O = 98.0665
LITRE = 1e-3


def elastic_recoil(volume, rest, alpha, stiffness):
    """p_el = 2√3 α k_s (1/R − R₀/R²) of a spherical spring net under uniform dilation, Pa."""
    radius, rest_radius = np.cbrt(3 * volume / (4 * np.pi)), np.cbrt(3 * rest / (4 * np.pi))
    return 2 * np.sqrt(3) * alpha * stiffness * (1 / radius - rest_radius / radius**2)


@pytest.fixture(scope="module", params=[0.25, 1.0, 3.0])
def sphere_lung(request):
    alpha = request.param
    return alpha, scenarios.run(scenarios.load("sphere-lung", {"forces.alpha": alpha}))


def test_table_2_residuals_on_the_sphere(sphere_lung):
    """Figures 8-11: a soft lung keeps volume, a stiff one returns, in every cycle."""
    alpha, dataset = sphere_lung
    residual = scenarios.breaths(dataset)["residual_volume"].to_numpy() / 3.5
    assert len(residual) == 5
    lowest, highest = {0.25: (0.20, 1.0), 1.0: (0.01, 0.15), 3.0: (-0.01, 0.01)}[alpha]
    assert ((lowest < residual) & (residual < highest)).all()


def test_the_first_exhalation_follows_its_closed_form(sphere_lung):
    """R dV/dt = −(p_el − κ N_def/B − ΔP) with B = 8R³, from the simulated end of inhalation."""
    alpha, dataset = sphere_lung
    volume = dataset["volume"].to_numpy() * LITRE
    start, end = 60, 120  # frames at 2 s and 4 s
    assert dataset["time"][start] == pytest.approx(2)
    assert dataset["time"][end] == pytest.approx(4)

    def exhale(_, y):
        box = 6 / np.pi * y[0]  # 8R³ = 6V/π
        drive = 2e-3 * 100 / box - 40 / 60 * CMH2O
        recoil = elastic_recoil(y[0], volume[0], alpha, 375.0)
        return [-(recoil - drive) / (10 * CMH2O / LITRE)]

    times = dataset["time"].to_numpy()[start : end + 1]
    exact = solve_ivp(exhale, (2, 4), [volume[start]], t_eval=times, rtol=1e-10, atol=1e-12).y[0]
    # the bound that the project promises; an icosphere of 642 points stays well below it
    assert np.abs(volume[start : end + 1] - exact).max() < 0.015 * 3.5 * LITRE


@pytest.mark.parametrize(
    ("sphere", "tolerance"),
    [
        # twelve points of an icosphere have five neighbours, which adds 1.1 % to Σ l⁰²
        (icosphere(3), 0.015),
        # an uneven net gives way where it is weak
        (fibonacci_sphere(642), 0.12),
    ],
    ids=["icosphere", "fibonacci"],
)
def test_inflation_to_a_held_pressure(sphere, tolerance):
    """At rest under a held pressure the recoil balances it."""
    mesh = sphere.scaled_to_volume(2.5 * LITRE)
    laws = [MassSpring(375.0, 0.5), InternalPressure(0.0), AirwayResistance(2e5)]
    body = SoftBody(SoftBodyModel(mesh, 1.0, laws), SDIRK2())
    for pressure in (400.0, 900.0, 1500.0):
        for _ in range(60):
            seen = body.step(0.05, delta_p=pressure)
        assert abs(seen.flow) < 1e-7
        recoil = elastic_recoil(seen.volume, mesh.volume, 1.0, 375.0)
        assert recoil == pytest.approx(pressure, rel=tolerance)


@pytest.fixture(scope="module")
def anatomical():
    """Residuals over five cycles on the coarse anatomical surface, by α."""
    changes = {"mesh.lung": "lung-right-770"}
    return {
        variant: scenarios.breaths(scenarios.run(scenarios.load(f"lung-{variant}", changes)))
        for variant in "abc"
    }


def test_table_2_order_on_the_anatomical_lung(anatomical):
    """Residual volume falls as α rises, in every one of five cycles."""
    soft, middling, stiff = (anatomical[v]["residual_volume"].to_numpy() for v in "abc")
    assert len(soft) == len(middling) == len(stiff) == 5
    # not by rounding: each step of α takes off more than 1 % of b = 1.75 L
    assert (soft > middling + 0.0175).all()
    assert (middling > stiff + 0.0175).all()


@pytest.mark.slow
def test_table_2_order_on_the_full_lung():
    residuals = {}
    for variant in "abc":
        dataset = scenarios.run(scenarios.load(f"lung-{variant}"))
        residuals[variant] = scenarios.breaths(dataset)["residual_volume"].to_numpy()
        assert dataset.sizes["time"] == 601
    assert (residuals["a"] > residuals["b"] + 0.0175).all()
    assert (residuals["b"] > residuals["c"] + 0.0175).all()


def test_pressure_control_reaches_the_tidal_volume_of_one_compartment():
    """R and C, fitted to one breath of the body, predict its tidal volume in other breaths."""
    changes = {"mesh.lung": "lung-right-770", "run.cycles": 3}
    dataset = scenarios.run(scenarios.load("lung-pressure-control", changes))
    last_breath = dataset.sel(time=slice(8, None))
    fitted = scenarios.fit_compartment(last_breath)
    assert fitted.resistance == pytest.approx(10, rel=0.03)  # R_aw; the rest is tissue damping
    tidal = float(scenarios.breaths(dataset)["tidal_volume"][-1])
    assert fitted.tidal_volume(15, 1.5, 4) == pytest.approx(tidal, rel=0.01)
    for driving, inspiratory, period in ((12, 1, 3), (10, 1.5, 4)):
        other = {
            "controller.pressure-control.driving_pressure": f"{driving} cmH2O",
            "controller.pressure-control.inspiratory_time": f"{inspiratory} s",
            "controller.pressure-control.rate": f"{60 / period} 1/min",
            "run.period": f"{period} s",
        }
        dataset = scenarios.run(scenarios.load("lung-pressure-control", {**changes, **other}))
        tidal = float(scenarios.breaths(dataset)["tidal_volume"][-1])
        # the lung stiffens as it fills, so its compliance at 15 cmH2O is 2 % off at 10
        assert fitted.tidal_volume(driving, inspiratory, period) == pytest.approx(tidal, rel=0.03)
