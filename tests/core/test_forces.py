"""What every force law has to do, parametrised over the table."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from softbody_core import (
    FORCES,
    AirwayResistance,
    Gravity,
    InternalPressure,
    MassSpring,
    SurfaceSPH,
    icosphere,
)
from softbody_core.configuration import Configuration
from softbody_core.forces import ResistanceLaw
from softbody_core.state import Inputs
from tests.core import tangents
from tests.core.forces import ALL, EXAMPLES, INPUTS, bound, deformed, force_at, jacobian

each_law = pytest.mark.parametrize("law", ALL, ids=repr)
seeds = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize("name", FORCES)
def test_every_law_has_an_example(name):
    assert EXAMPLES.get(name), (
        f"{name} is in FORCES, but no test looks at it: add the line "
        f'"{name}": [{FORCES[name].__name__}(…)], with parameters that make it act, to EXAMPLES in '
        "tests/core/forces.py"
    )


# What a law says of itself


@each_law
def test_a_law_acts_at_rest_if_it_says_so(law, potato):
    force, _ = bound(law, potato)
    at_rest = force_at(force, potato, np.ascontiguousarray(potato.points.T), inputs=Inputs())
    # rounding of densities and lengths alone
    acts = bool(np.abs(at_rest).max() > 1e-9)
    assert acts == law.acts_at_rest, (
        f"{law!r}.acts_at_rest is {law.acts_at_rest}, but its largest force on a body at rest, "
        f"without inputs, is {np.abs(at_rest).max():.3g} N"
    )


@each_law
def test_a_law_of_the_examples_acts(law):
    assert law.acts, f"{law!r} does nothing, so it is no example: give it other parameters"


def resultant_and_torque(law, mesh, seed):
    """Largest component of either, over the sum of all forces; N and m in a body of 0.1 m."""
    generator = np.random.default_rng(seed)
    force, _ = bound(law, mesh)
    x = deformed(mesh, generator)
    # a turning body is at rest to itself: dampers that see only relative velocities along
    # edges' ends do resist it, so the velocities here are a translation for the torque's sake
    v = np.ones_like(x) * generator.normal(size=(3, 1))
    actual = force_at(force, mesh, x, v)
    torque = np.cross(x.T, actual.T).sum(axis=0)
    largest = max(np.abs(actual.sum(axis=1)).max(), np.abs(torque).max())
    total = np.abs(actual).sum()
    return largest / total if total > 0 else 0.0  # a translation is no flow: nothing may resist it


@each_law
@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_forces_have_a_resultant_or_torque_only_if_the_law_is_not_internal(law, potato, seed):
    share = resultant_and_torque(law, potato, seed)
    assert (share <= 1e-13) == law.internal, (
        f"{law!r}.internal is {law.internal}, but resultant and torque are {share:.3g} of the "
        "forces"
    )


@each_law
@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_forces_move_and_turn_with_the_body_if_the_law_is_objective(law, potato, seed):
    generator = np.random.default_rng(seed)
    force, _ = bound(law, potato)
    x = deformed(potato, generator)
    v = generator.normal(size=x.shape)
    turn = Rotation.random(random_state=seed).as_matrix()
    move = generator.normal(size=(3, 1))
    turned = force_at(force, potato, turn @ x + move, turn @ v).copy()
    expected = turn @ force_at(force, potato, x, v)
    # Roundings of positions a metre away, over arms of slim triangles that can be a tenth of a
    # micrometre: 1e-9. What does not turn with the body is off by 3e-4 or more, in 250 bodies.
    off = np.abs(turned - expected).max() / max(1, np.abs(expected).max())
    assert (off <= 1e-8) == law.objective, (
        f"{law!r}.objective is {law.objective}, but forces on a body that is moved and turned are "
        f"{off:.3g} off those of the body where it was"
    )


@pytest.mark.parametrize("law", [law for law in ALL if isinstance(law, ResistanceLaw)], ids=repr)
@settings(max_examples=20, deadline=None)
@given(flow=st.floats(-0.01, 0.01))
def test_the_differential_resistance_is_the_slope_of_the_pressure_drop(law, flow):
    drop = lambda q: law.resistance_at(q) * q  # noqa: E731
    step = 1e-6  # m³/s; a drop has a kink at no flow at most
    slope = (drop(flow + step) - drop(flow - step)) / (2 * step)
    assert law.differential_resistance_at(flow) == pytest.approx(slope, rel=1e-3)
    assert law.resistance_at(flow) >= 0


# The force


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


closed = [law for law in ALL if tangents.is_closed(law)]


@pytest.mark.parametrize("law", closed, ids=repr)
@settings(max_examples=3, deadline=None)
@given(seed=seeds)
def test_closed_forms_of_tangents_are_derivatives_of_the_force(law, potato, seed):
    generator = np.random.default_rng(seed)
    force, _ = bound(law, potato)
    x = deformed(potato, generator)
    here = Configuration(potato, x)
    stiffness = tangents.stiffness(force, here, INPUTS).toarray()
    differences = -jacobian(lambda at: force_at(force, potato, at), x, 1e-6)
    scale = max(np.abs(differences).max(), 1e-3)
    # the box has kinks only where its extreme points change; 1e-6 m does not reach one
    np.testing.assert_allclose(stiffness, differences, atol=2e-5 * scale)
    v = 0.1 * generator.normal(size=x.shape)
    damping = tangents.damping(force, here, v, INPUTS).toarray()
    differences = -jacobian(lambda at: force_at(force, potato, x, at), v, 1e-3)
    # the force is linear in the velocities, so differences have no truncation error
    scale = max(np.abs(differences).max(), 1e-6)
    np.testing.assert_allclose(damping, differences, atol=1e-8 * scale)


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


# What bounds the exact tangents


@each_law
@settings(max_examples=5, deadline=None)
@given(seed=seeds)
def test_rates_bound_the_spectral_radii(law, potato, seed):
    generator = np.random.default_rng(seed)
    force, masses = bound(law, potato)
    x = deformed(potato, generator)
    v = 0.1 * generator.normal(size=x.shape)
    here = Configuration(potato, x)
    rates = force.rates(here, v, INPUTS)
    scale = np.tile(masses, 3)[:, None]
    # rounding; differences of the force have the accuracy of the test of closed forms
    slack = 1e-9 if tangents.is_closed(law) else 1e-4
    for bound_, tangent in (
        (rates.stiffness, tangents.stiffness(force, here, INPUTS)),
        (rates.damping, tangents.damping(force, here, v, INPUTS)),
    ):
        eigenvalues = np.linalg.eigvals(tangent.toarray() / scale)
        # oscillation, not buckling, limits a step: the real parts count
        assert eigenvalues.real.max() <= bound_ * (1 + slack)


@each_law
def test_majorants_are_definite_and_at_least_half_the_tangents_at_rest(law):
    """An iteration with them converges where they are at least half the exact matrix."""
    mesh = icosphere(2, 0.084)
    force, _ = bound(law, mesh)
    rest = Configuration(mesh, np.ascontiguousarray(mesh.points.T))
    still, inputs = np.zeros_like(rest.positions), Inputs()
    exact = tangents.stiffness(force, rest, inputs), tangents.damping(force, rest, still, inputs)
    for majorant, tangent in zip(force.majorants(), exact, strict=True):
        if majorant is None:
            continue
        operator = np.kron(np.eye(3), majorant.toarray())
        size = np.linalg.norm(operator, 2) or 1.0  # a law may have no damping
        assert np.linalg.eigvalsh(operator)[0] >= -1e-12 * size
        # masses keep the matrix of an implicit equation regular along rigid motions, as here
        regular = 2 * operator + 1e-6 * size * np.eye(len(operator))
        assert np.linalg.eigvals(np.linalg.solve(regular, tangent.toarray())).real.max() <= 1


@settings(max_examples=20, deadline=None)
@given(seed=seeds, squeeze=st.floats(0.05, 3.0))
def test_spring_operator_is_definite_and_at_least_the_stiffness(potato, seed, squeeze):
    """The positive definite stand-in of the implicit schemes, for squeezed springs too."""
    force, _ = bound(MassSpring(100.0, 0.2), potato)
    x = squeeze * deformed(potato, np.random.default_rng(seed))
    stiffness = tangents.stiffness(force, Configuration(potato, x), INPUTS).toarray()
    operator = np.kron(np.eye(3), force.majorants().stiffness.toarray())
    assert np.linalg.eigvalsh(operator)[0] > -1e-9
    assert np.linalg.eigvalsh(operator - stiffness)[0] > -1e-7 * np.linalg.norm(operator, 2)


def test_squeezed_springs_are_indefinite(potato):
    """Why the implicit schemes need a stand-in at all."""
    force, _ = bound(MassSpring(100.0), potato)
    x = 0.5 * np.ascontiguousarray(potato.points.T)
    stiffness = tangents.stiffness(force, Configuration(potato, x), INPUTS).toarray()
    assert np.linalg.eigvalsh(stiffness)[0] < -1.0


# Single laws


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
    pressure = law.pressure(here, INPUTS)
    assert pressure == pytest.approx(2e-3 * 40_000 / box + 350, rel=1e-14)
    enclosed = InternalPressure(2e-3, "enclosed-volume")
    expected = 2e-3 * 40_000 / here.volume + 350
    pressure = enclosed.pressure(here, INPUTS)
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
