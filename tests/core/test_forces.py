"""What every force law has to do, parametrised over the table."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from softbody_core import AirwayResistance, Gravity, InternalPressure, MassSpring, SurfaceSPH
from softbody_core.configuration import Configuration
from softbody_core.state import Inputs
from tests.core.forces import ALL, INPUTS, bound, deformed, dense, force_at, jacobian

each_law = pytest.mark.parametrize("law", ALL, ids=repr)
seeds = st.integers(0, 2**32 - 1)


@each_law
def test_rest_under_no_input_is_free_of_force(law, potato):
    if isinstance(law, Gravity):
        pytest.skip("gravity acts at rest too")
    force, _ = bound(law, potato)
    at_rest = force_at(force, potato, np.ascontiguousarray(potato.points.T), inputs=Inputs())
    # rounding of densities and lengths alone
    assert np.abs(at_rest).max() < 1e-9


@each_law
@settings(max_examples=5, deadline=None)
@given(seed=seeds)
def test_force_is_minus_the_gradient_of_energy(law, potato, seed):
    force, _ = bound(law, potato)
    x = deformed(potato, np.random.default_rng(seed))
    if force.energy(Configuration(potato, x), INPUTS) is None:
        pytest.skip("this law has no potential")
    expected = np.empty_like(x)
    step = 1e-6
    for index in np.ndindex(x.shape):
        energies = []
        for steps in (1, -1, 2, -2):
            moved = x.copy()
            moved[index] += steps * step
            energies.append(force.energy(Configuration(potato, moved), INPUTS))
        up, down, far_up, far_down = energies
        # fourth order: slim triangles bend on arms of a tenth of a millimetre
        expected[index] = -(8 * (up - down) - (far_up - far_down)) / (12 * step)
    actual = force_at(force, potato, x)
    # differences of energies of about 1 J at 1e-6 m lose ten digits: 1e-10 N
    np.testing.assert_allclose(actual, expected, atol=2e-6 * max(1, np.abs(actual).max()))


@each_law
@settings(max_examples=3, deadline=None)
@given(seed=seeds)
def test_stiffness_and_damping_are_derivatives_of_the_force(law, potato, seed):
    generator = np.random.default_rng(seed)
    force, _ = bound(law, potato)
    x = deformed(potato, generator)
    here = Configuration(potato, x)
    stiffness = dense(force.stiffness(here, INPUTS), x.shape)
    differences = -jacobian(lambda at: force_at(force, potato, at), x, 1e-6)
    scale = max(np.abs(differences).max(), 1e-3)
    # the box has kinks only where its extreme points change; 1e-6 m does not reach one
    np.testing.assert_allclose(stiffness, differences, atol=2e-5 * scale)
    v = 0.1 * generator.normal(size=x.shape)
    damping = dense(force.damping(here), x.shape)
    differences = -jacobian(lambda at: force_at(force, potato, x, at), v, 1e-3)
    # the force is linear in the velocities, so differences have no truncation error
    scale = max(np.abs(differences).max(), 1e-6)
    np.testing.assert_allclose(damping, differences, atol=1e-8 * scale)


def _is_internal(law):
    return not isinstance(law, Gravity) and getattr(law, "pressure", "") != "difference"


@pytest.mark.parametrize("law", [law for law in ALL if _is_internal(law)], ids=repr)
@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_internal_forces_have_no_resultant_and_no_torque(law, potato, seed):
    generator = np.random.default_rng(seed)
    force, _ = bound(law, potato)
    x = deformed(potato, generator)
    # a turning body is at rest to itself: dampers that see only relative velocities along
    # edges' ends do resist it, so the velocities here are a translation for the torque's sake
    v = np.ones_like(x) * generator.normal(size=(3, 1))
    actual = force_at(force, potato, x, v)
    size = np.abs(actual).sum()
    assert np.abs(actual.sum(axis=1)).max() <= 1e-13 * size
    torque = np.cross(x.T, actual.T).sum(axis=0)
    assert np.abs(torque).max() <= 1e-13 * size


@pytest.mark.parametrize("law", [law for law in ALL if _is_internal(law)], ids=repr)
@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_forces_move_and_turn_with_the_body(law, potato, seed):
    if isinstance(law, InternalPressure) and law.over == "bounding-box":
        pytest.skip("the box does not turn with the body (model reading 4)")
    generator = np.random.default_rng(seed)
    force, _ = bound(law, potato)
    x = deformed(potato, generator)
    v = generator.normal(size=x.shape)
    turn = Rotation.random(random_state=seed).as_matrix()
    move = generator.normal(size=(3, 1))
    turned = force_at(force, potato, turn @ x + move, turn @ v)
    expected = turn @ force_at(force, potato, x, v)
    # moving by a metre costs a digit of positions of 0.1 m
    np.testing.assert_allclose(turned, expected, atol=1e-11 * max(1, np.abs(expected).max()))


@each_law
@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_motion_is_never_fed(law, potato, seed):
    """What depends on velocities takes energy out: readings 1 and 6 of the misprints."""
    generator = np.random.default_rng(seed)
    force, _ = bound(law, potato)
    x = deformed(potato, generator)
    v = generator.normal(size=x.shape)
    drag = force_at(force, potato, x, v) - force_at(force, potato, x)
    assert np.vdot(drag, v) <= 1e-12 * np.abs(drag).sum()


@each_law
@settings(max_examples=5, deadline=None)
@given(seed=seeds)
def test_rates_bound_the_spectral_radii(law, potato, seed):
    force, masses = bound(law, potato)
    x = deformed(potato, np.random.default_rng(seed))
    here = Configuration(potato, x)
    rates = force.rates(here, INPUTS)
    scale = np.tile(masses, 3)[:, None]
    for bound_, tangent in (
        (rates.stiffness, force.stiffness(here, INPUTS)),
        (rates.damping, force.damping(here)),
    ):
        eigenvalues = np.linalg.eigvals(dense(tangent, x.shape) / scale)
        # oscillation, not buckling, limits a step: the real parts count
        assert eigenvalues.real.max() <= bound_ * (1 + 1e-9)


@settings(max_examples=20, deadline=None)
@given(seed=seeds, squeeze=st.floats(0.05, 3.0))
def test_spring_operator_is_definite_and_at_least_the_stiffness(potato, seed, squeeze):
    """The positive definite stand-in of the implicit schemes, for squeezed springs too."""
    force, _ = bound(MassSpring(100.0, 0.2), potato)
    x = squeeze * deformed(potato, np.random.default_rng(seed))
    stiffness = dense(force.stiffness(Configuration(potato, x), INPUTS), x.shape)
    operator = np.kron(np.eye(3), force.bounding_operators()[0].toarray())
    assert np.linalg.eigvalsh(operator)[0] > -1e-9
    assert np.linalg.eigvalsh(operator - stiffness)[0] > -1e-7 * np.linalg.norm(operator, 2)


def test_squeezed_springs_are_indefinite(potato):
    """Why the implicit schemes need a stand-in at all."""
    force, _ = bound(MassSpring(100.0), potato)
    x = 0.5 * np.ascontiguousarray(potato.points.T)
    stiffness = dense(force.stiffness(Configuration(potato, x), INPUTS), x.shape)
    assert np.linalg.eigvalsh(stiffness)[0] < -1.0


def test_literal_area_share_pushes_three_times_as_hard(potato):
    x = deformed(potato, np.random.default_rng(1))
    third, _ = bound(InternalPressure(1e-3), potato)
    whole, _ = bound(InternalPressure(1e-3, area_share="whole"), potato)
    np.testing.assert_allclose(
        force_at(whole, potato, x), 3 * force_at(third, potato, x), rtol=1e-14
    )


def test_eq_7_as_printed_does_not_conserve_momentum(potato):
    x = deformed(potato, np.random.default_rng(1))
    printed, _ = bound(SurfaceSPH(30.0, pressure="difference"), potato)
    actual = force_at(printed, potato, x)
    assert np.abs(actual.sum(axis=1)).max() > 1e-2 * np.abs(actual).max()


def test_pressure_is_gas_over_box_plus_drive(potato):
    x = deformed(potato, np.random.default_rng(2))
    here = Configuration(potato, x)
    box = np.prod(np.ptp(x, axis=1))
    law = InternalPressure(2e-3)
    pressure = law.pressure(law.gas_volume(here), INPUTS)
    assert pressure == pytest.approx(2e-3 * 40_000 / box + 350, rel=1e-14)
    enclosed = InternalPressure(2e-3, "enclosed-volume")
    expected = 2e-3 * 40_000 / here.volume + 350
    pressure = enclosed.pressure(enclosed.gas_volume(here), INPUTS)
    assert pressure == pytest.approx(expected, rel=1e-14)


def test_resistance_takes_its_share_of_wall_pressure(potato):
    """A·F = −R (A·A) dV/dt, so the wall feels R dV/dt less pressure."""
    generator = np.random.default_rng(3)
    x, v = deformed(potato, generator), generator.normal(size=(3, potato.n_points))
    force, _ = bound(AirwayResistance(5e4), potato)
    gradient = Configuration(potato, x).volume_gradient
    flow = np.vdot(gradient, v)
    np.testing.assert_allclose(force_at(force, potato, x, v), -5e4 * flow * gradient, rtol=1e-12)


def test_weights_are_masses_times_standard_gravity(potato):
    force, masses = bound(Gravity(), potato)
    actual = force_at(force, potato, np.ascontiguousarray(potato.points.T))
    np.testing.assert_allclose(actual[2], -9.80665 * masses, rtol=1e-15)
    assert not actual[:2].any()
