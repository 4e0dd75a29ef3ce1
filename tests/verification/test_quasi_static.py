"""Quasi-static breathing against closed forms, SciPy and the body with mass."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from softbody_core import (
    INTEGRATORS,
    SDIRK2,
    AirwayResistance,
    DivergenceError,
    Gravity,
    InternalPressure,
    MassSpring,
    ParameterError,
    SoftBody,
    SoftBodyModel,
    Weights,
    icosphere,
)
from softbody_core.configuration import Configuration
from softbody_core.state import Inputs

QuasiStatic = INTEGRATORS["quasi-static"]

REST = 2.5e-3
STIFFNESS = 375.0
RESISTANCE = 2e5
SMALL = icosphere(1).scaled_to_volume(REST)
FINE = {"spacing": 0.005, "tolerance": 1e-9, "max_iterations": 300}
"""Shapes are joined linearly in ln V, so volumes err by spacing²/8 = 3e-6 where springs are soft:
the recoil c (e^(−u/3) − e^(−2u/3)), u = ln V/V₀, has slope c/3 and curvature −c/3 at rest."""

GAS = InternalPressure(1e-3, "enclosed-volume")


def sphere(integrator, mesh=SMALL, mass=1.0, damping=0.1, resistance=RESISTANCE):
    laws = [MassSpring(STIFFNESS, damping), GAS, AirwayResistance(resistance)]
    return SoftBody(SoftBodyModel(mesh, mass, laws), integrator)


def breathe(body, pressures, dt=0.05, n=0.0):
    return np.array([body.step(dt, pressure, n).volume for pressure in pressures])


class Truth(NamedTuple):
    """Recoil, Pa, and ΣΔ², 1/m⁴, of the edges' change of dx/dV, by volume, m³."""

    recoil: CubicSpline
    yielding: CubicSpline


@pytest.fixture(scope="module")
def truth():
    """Springs of an icosphere of 42 points, by minimizing their energy at each volume.

    By symmetry its 12 points with five neighbours are at one radius, and the other 30 at another:
    the ratio of the two is the only unknown. Nodes crowd near rest, where it changes fast.
    """
    edges, few = SMALL.edges, np.bincount(SMALL.edges.ravel()) == 5

    def shape(volume, ratio):
        x = SMALL.points * np.where(few, ratio, 1.0)[:, None]
        return x * np.cbrt(6 * volume / np.linalg.det(x[SMALL.triangles]).sum())

    def lengths(x):
        return np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)

    rest, recoils, shapes = lengths(SMALL.points), [], []
    volumes = REST * (1 + 1.2 * np.linspace(0, 1, 121) ** 3)
    for volume in volumes:
        energy = lambda q, v=volume: np.sum((lengths(shape(v, q)) - rest) ** 2)  # noqa: E731
        ratio = minimize_scalar(energy, bounds=(0.7, 1.4), options={"xatol": 1e-12}).x
        x = shape(volume, ratio)
        # dE/dV at a fixed ratio: lengths grow as V^(1/3)
        recoils.append(STIFFNESS * np.sum((lengths(x) - rest) * lengths(x)) / (3 * volume))
        shapes.append(x)
    slopes = CubicSpline(volumes, np.array(shapes))(volumes, 1)
    stretch = slopes[:, edges[:, 1]] - slopes[:, edges[:, 0]]
    return Truth(
        CubicSpline(volumes, recoils), CubicSpline(volumes, np.sum(stretch**2, axis=(1, 2)))
    )


@pytest.mark.parametrize("share", [1.01, 1.1, 1.5, 2.0, 3.0, 5.0, 8.0])
def test_the_recoil_of_a_sphere_follows_its_closed_form(share):
    """p_el = 2√3 k_s (1/R − R₀/R²) under a uniform dilation."""
    mesh = icosphere(3).scaled_to_volume(REST)
    radius, rest = np.cbrt(3 * REST / (4 * np.pi) * np.array([share, 1.0]))
    expected = 2 * np.sqrt(3) * STIFFNESS * (1 / radius - rest / radius**2)
    path = sphere(QuasiStatic(spacing=0.01), mesh)._stepper._path
    recoil = path.balance(share * REST).recoil
    # twelve points have five neighbours, which adds 1.1 % to Σ l⁰²; linear pieces miss
    # spacing²/8 of the slope c/3, c = 2√3 k_s/R₀
    missed = 0.01**2 / 8 * 2 * np.sqrt(3) * STIFFNESS / rest / 3
    assert recoil == pytest.approx(expected, rel=0.012, abs=missed)


@pytest.mark.parametrize("damping", [0.0, 4.0])
def test_the_volume_follows_its_scalar_equation(truth, damping):
    """(R + R_tissue) dV/dt = κN/V + ΔP − p_el(V), with SciPy for all of it."""
    pressures, gas = [1500.0, 2000.0, 300.0, 600.0], 0.5

    def flow(_, y, pressure):
        tissue = damping * truth.yielding(y[0])
        return [(pressure + gas / y[0] - truth.recoil(y[0])) / (RESISTANCE + tissue)]

    exact, volume = [], REST
    for pressure in pressures:
        options = {"args": (pressure,), "rtol": 1e-10, "atol": 1e-14}
        volume = solve_ivp(flow, (0, 0.05), [volume], **options).y[0, -1]
        exact.append(volume)
    errors = []
    for spacing in (0.02, 0.005):
        body = sphere(QuasiStatic(**FINE | {"spacing": spacing}), damping=damping)
        reached = breathe(body, pressures, n=gas / GAS.gas_energy)
        errors.append(np.abs(reached - exact).max() / REST)
    # 3e-6 of linear pieces; with dampers, the first piece has the drag of the springs' operator
    # for that of the true way, a tenth off, which acts on a tenth of the resistance for 0.005
    assert errors[1] < (5e-6 if damping == 0 else 5e-5)
    # a test of the dampers too: they take a hundred times as much off the first volume
    undamped = sphere(QuasiStatic(**FINE), damping=0.0)
    slower = breathe(undamped, pressures[:1], n=gas / GAS.gas_energy)[0] - exact[0]
    assert damping == 0 or slower > 5e-3 * REST
    assert damping or errors[0] / errors[1] == pytest.approx(
        16, rel=0.25
    )  # second order in spacing


def test_the_body_with_mass_tends_to_the_one_without():
    """The difference falls about in proportion to the mass."""
    pressures, masses = [900.0] * 6, [1.0, 0.3, 0.1]
    without = breathe(sphere(QuasiStatic(**FINE)), pressures)
    apart = []
    for mass in masses:
        integrator = SDIRK2(tolerance=1e-8, max_iterations=100)
        apart.append(np.abs(breathe(sphere(integrator, mass=mass), pressures) - without).max())
    # 127 Pa·s²/m³ a kg, on 2e5 Pa·s/m³, delays a flow of 4 L/s by 0.6 ms: 1e-3 of the volume
    assert 1e-4 < apart[0] / REST < 2e-3
    power = np.polyfit(np.log(masses), np.log(apart), 1)[0]
    assert power == pytest.approx(1, abs=0.05)  # 1e-5 of both schemes' errors, on 4e-5 to 4e-4
    light = sphere(SDIRK2(tolerance=1e-8, max_iterations=100), mass=0.01)
    assert np.abs(breathe(light, pressures) - without).max() < 5e-5 * REST  # what both err by


@pytest.mark.parametrize("gas", [0.0, 2.0])
def test_without_resistance_one_step_reaches_equilibrium(gas):
    n = gas / GAS.gas_energy
    free = sphere(QuasiStatic(**FINE), damping=0.0, resistance=0.0)
    seen = free.step(1e-3, 900.0, n)
    assert seen.volume > 1.15 * REST
    # the wall's pressure is balanced by the recoil of the springs, at every point
    here = Configuration(SMALL, free.state.positions)
    springs = free.model.terms[0][1].force(here, np.zeros((3, 42)), Inputs())
    pushed = seen.pressure * here.volume_gradient
    # linear pieces of a curved way: 3e-6 of the radius, against a stretch of a tenth of it
    assert np.linalg.norm(springs + pushed) < 1e-4 * np.linalg.norm(pushed)
    # and a light body comes to rest there too: time constants are 0.1 s with these dampers
    slow = sphere(SDIRK2(), mass=0.05, damping=10.0, resistance=0.0)
    rested = breathe(slow, [900.0] * 40, n=n)[-1]
    assert abs(slow.observe().flow) < 1e-9
    assert seen.volume == pytest.approx(rested, rel=1e-5)  # spacing²/8, and its slope falls to 0.4


@pytest.mark.parametrize("resistance", [0.0, RESISTANCE], ids=["open", "resisting"])
def test_a_second_breath_costs_no_force_evaluation(resistance):
    body = sphere(QuasiStatic(), resistance=resistance)
    breath = [400.0, 900.0, 1500.0, 900.0, 400.0, *[0.0] * 10]
    first = breathe(body, breath, dt=0.5)
    cost = body.counters
    assert cost.force_evaluations > 20
    second = breathe(body, breath, dt=0.5)
    assert body.counters.force_evaluations == cost.force_evaluations
    assert body.counters.linear_solves == cost.linear_solves
    # it starts where the first ended: at the tolerance of the recoil, 1e-5, from rest
    np.testing.assert_allclose(second, first, rtol=1e-4)


def test_what_falls_or_has_no_shape_is_refused():
    def refusal(laws, **options):
        with pytest.raises(ParameterError) as caught:
            SoftBody(SoftBodyModel(SMALL, 1.0, laws, **options), QuasiStatic())
        return str(caught.value)

    falls = refusal([MassSpring(STIFFNESS), Gravity()])
    assert "9.81 N; pin it (constraints), set the weight of gravity delta = 0, or" in falls
    for nothing in ([GAS], [MassSpring(0.0, 1.0)]):
        assert "add mass_spring with a positive stiffness" in refusal(nothing)
    # what it says to try does help
    laws = [MassSpring(STIFFNESS), GAS, Gravity()]
    floating = SoftBodyModel(SMALL, 1.0, laws, Weights(delta=0))
    assert SoftBody(floating, QuasiStatic()).step(1.0).volume == pytest.approx(REST, rel=1e-9)


@pytest.mark.parametrize("resistance", [0.0, RESISTANCE], ids=["open", "resisting"])
def test_a_runaway_is_named_and_leaves_no_trace(resistance):
    """No spring net holds 6000 Pa: its recoil is at most √3 k_s/(2 R₀) = 3.9 kPa, at 2 R₀."""
    body, twin = (sphere(QuasiStatic(), resistance=resistance) for _ in range(2))
    for one in (body, twin):
        one.step(0.1, 900.0)
    before = body.get_state()
    with pytest.raises(DivergenceError, match=r"volume over rest volume became 1[0-9]{3}"):
        body.step(1000.0, 6000.0)
    assert body.state is before.state
    assert body.counters == before.counters
    assert body.step(0.1, 300.0).volume == twin.step(0.1, 300.0).volume
    np.testing.assert_array_equal(body.positions, twin.positions)
    np.testing.assert_array_equal(body.velocities, twin.velocities)
    assert body.counters == twin.counters


def test_restoring_in_the_middle_of_a_breath_repeats_to_the_bit():
    """Also the path: what is learned later must not lead the body elsewhere."""
    body = sphere(QuasiStatic())
    breathe(body, [900.0, 1500.0, 300.0])
    saved = body.get_state()
    onward = [200.0, -300.0, 1800.0, 0.0, 600.0]
    volumes, positions, work = breathe(body, onward), body.positions, body.counters
    breathe(body, [2500.0, -500.0, 2500.0])  # shapes that were not known at the saved point
    assert body.counters.force_evaluations > work.force_evaluations
    body.set_state(saved)
    np.testing.assert_array_equal(breathe(body, onward), volumes)
    np.testing.assert_array_equal(body.positions, positions)
    assert body.counters == work


def test_a_body_without_gas_rests():
    body = SoftBody(SoftBodyModel(SMALL, 1.0, [MassSpring(STIFFNESS)]), QuasiStatic())
    assert body.step(1.0).volume == pytest.approx(REST, rel=1e-9)


def test_size_does_not_matter():
    """Lengths and stiffness a thousandth: the same pressures, and the same relative volumes."""
    shares = []
    for size in (1.0, 1e-3):
        laws = [MassSpring(size * STIFFNESS), GAS]
        body = SoftBody(SoftBodyModel(SMALL.scaled(size), 1.0, laws), QuasiStatic())
        shares.append(body.step(1.0, 900.0).volume / body.model.mesh.volume)
    assert shares[1] == pytest.approx(shares[0], rel=1e-6)  # the root's, and rounding


def test_a_body_that_dampers_slow_down_does_not_jump():
    volumes = []
    for spacing in (0.02, 0.00125):
        fine = QuasiStatic(**FINE | {"spacing": spacing})
        volumes.append(sphere(fine, damping=4.0, resistance=0.0).step(0.05, 1500.0).volume)
    # 0.02²/8 of linear pieces, and a drag that is a tenth off for the first 0.02; it jumps by 1e-2
    assert volumes[1] == pytest.approx(volumes[0], rel=1e-3)


def test_the_drag_at_rest_is_that_of_the_way_out(truth):
    body = sphere(QuasiStatic(**FINE), damping=1.0)
    drag = body._stepper._path.balance(REST).drag
    assert drag == pytest.approx(float(truth.yielding(REST)), rel=0.02)  # first order in spacing
