"""The finite-element membrane against closed forms, beside the springs."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from softbody_core import (
    INTEGRATORS,
    AirwayResistance,
    InternalPressure,
    MassSpring,
    Membrane,
    ParameterError,
    SoftBody,
    SoftBodyModel,
    fibonacci_sphere,
    icosphere,
)
from softbody_core.configuration import Configuration
from softbody_core.state import Inputs
from tests.core import tangents
from tests.core.forces import bound, force_at
from tests.verification.sheets import slab

seeds = st.integers(0, 2**32 - 1)

SPRINGS = MassSpring(375.0)
LAW = Membrane(2 / np.sqrt(3) * 375.0, 1 / 3)
"""The springs' modulus at small strains: Y/(1 − ν) = √3 k_s."""


def inflated(law, mesh, pressure, stretch):
    """Cube root of the volume over that at rest, under a held pressure: Newton's method."""
    model = SoftBodyModel(mesh, 1.0, [law, InternalPressure(0.0)])
    inputs, x = Inputs(delta_p=pressure), stretch * mesh.points.T
    for _ in range(12):
        here = Configuration(mesh, x)
        force = model.force(here, np.zeros_like(x), inputs)
        if np.abs(force).max() < 1e-10 * pressure * mesh.point_areas.mean():
            return np.cbrt(here.volume / mesh.volume)
        # the stiffness along rigid motions is zero; a little mass keeps the body where it is
        stiffness = 1e-6 * LAW.stiffness * sp.eye_array(x.size)
        for _, bound_law in model.terms:
            stiffness = stiffness + tangents.stiffness(bound_law, here, inputs)
        x = x + spsolve(sp.csc_matrix(stiffness), force.ravel()).reshape(x.shape)
    raise AssertionError("Newton's method has not converged: the stiffness is not exact")


def of_membrane(stretch):
    """p R₀ = Y/(1 − ν) (s − 1/s).

    E = (s² − 1)/2 in both directions, so U = 4πR₀² Y E²/(1 − ν), and p = (dU/ds)/(4πR₀³ s²).
    """
    return LAW.stiffness / (1 - LAW.poisson_ratio) * (stretch - 1 / stretch)


def of_springs(stretch):
    """p R₀ = 2√3 k_s (1/s − 1/s²)."""
    return 2 * np.sqrt(3) * SPRINGS.stiffness * (1 / stretch - 1 / stretch**2)


def inflation_error(law, closed_form, mesh, stretch):
    """Pressure over that of the closed form at the volume it leads to, less one."""
    pressure = closed_form(stretch) / mesh.radius
    return pressure * mesh.radius / closed_form(inflated(law, mesh, pressure, stretch)) - 1


SIZES = {
    "icosphere": (icosphere(2), icosphere(3)),
    "Fibonacci": (fibonacci_sphere(162), fibonacci_sphere(642)),
}
FINE = {"icosphere": icosphere(4), "Fibonacci": fibonacci_sphere(2562)}


@pytest.mark.parametrize("stretch", [1.1, 1.3])
@pytest.mark.parametrize("kind", SIZES)
def test_an_inflated_membrane_converges_to_its_closed_form(kind, stretch):
    """At second order, whatever the net: 0.4 %, 0.1 %."""
    coarse, fine = (inflation_error(LAW, of_membrane, mesh, stretch) for mesh in SIZES[kind])
    assert abs(fine) < 0.0012
    # edges of half the length (points: 162 and 642), and one order of the mesh's own evenness
    assert np.log2(coarse / fine) == pytest.approx(2, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", SIZES)
def test_an_inflated_membrane_of_2562_points(kind):
    assert abs(inflation_error(LAW, of_membrane, FINE[kind], 1.2)) < 0.0003


def test_inflated_springs_are_near_theirs_on_an_even_net_alone():
    """No refinement helps where the net is uneven: it gives way where it is weak."""
    even, uneven = (
        [inflation_error(SPRINGS, of_springs, mesh, 1.1) for mesh in SIZES[kind]]
        for kind in ("icosphere", "Fibonacci")
    )
    assert np.abs(even).max() < 0.006
    assert (np.array(uneven) < -0.05).all()


def test_softly_inflated_the_two_laws_are_one():
    """Same modulus at small strains: the closed forms agree to first order."""
    strain = 1e-4
    assert of_springs(1 + strain) == pytest.approx(of_membrane(1 + strain), rel=3 * strain)


def test_inflation_is_where_dynamics_ends():
    """Every integrator family leads there: a body with mass, dampers and an airway."""
    mesh = icosphere(2).scaled_to_volume(2.5e-3)
    laws = [
        Membrane(LAW.stiffness, LAW.poisson_ratio, 0.5),
        InternalPressure(0.0),
        AirwayResistance(2e5),
    ]
    pressure = of_membrane(1.2) / mesh.radius
    expected = mesh.volume * inflated(LAW, mesh, pressure, 1.2) ** 3
    for name in ("velocity-verlet", "sdirk2", "quasi-static"):
        body = SoftBody(SoftBodyModel(mesh, 1.0, laws), INTEGRATORS[name]())
        for _ in range(60):
            seen = body.step(0.05, delta_p=pressure)
        # quasi-static joins shapes 5 % of the volume apart by straight lines: 0.05²/8
        assert seen.volume == pytest.approx(expected, rel=4e-4)


@settings(max_examples=20, deadline=None)
@given(seed=seeds, poisson=st.floats(-0.9, 0.9))
def test_a_linear_map_strains_each_triangle_evenly(potato, seed, poisson):
    """The energy of a uniform strain is exact, here by tensors in space."""
    generator = np.random.default_rng(seed)
    gradient = np.eye(3) + 0.5 * generator.uniform(-1, 1, size=(3, 3))
    law, _ = bound(Membrane(140.0, poisson), potato)
    moved = Configuration(potato, gradient @ potato.points.T)
    a, b, c = potato.points[potato.triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    doubled = np.linalg.norm(normals, axis=1)
    normals /= doubled[:, None]
    onto = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    strain = onto @ (0.5 * (gradient.T @ gradient - np.eye(3))) @ onto
    traces = np.trace(strain, axis1=1, axis2=2)
    densities = (1 - poisson) * np.sum(strain**2, axis=(1, 2)) + poisson * traces**2
    expected = 140.0 / (2 * (1 - poisson**2)) * np.sum(doubled / 2 * densities)
    # slim triangles lose some digits of their strain
    assert law.energy(moved, Inputs()) == pytest.approx(expected, rel=1e-11)


def test_a_linear_map_leaves_the_inside_of_a_flat_sheet_free_of_force():
    """The patch test: on an uneven net."""
    generator = np.random.default_rng(7)
    corners = np.array([[0, 0], [0, 1], [1, 1], [1, 0]])
    points = np.concatenate([corners, generator.uniform(0.02, 0.98, size=(60, 2))])
    mesh = slab(points)
    law, _ = bound(LAW, mesh)
    force = force_at(law, mesh, (np.eye(3) + 0.3 * generator.normal(size=(3, 3))) @ mesh.points.T)
    rim = np.zeros(mesh.n_points, dtype=bool)
    upright = np.ptp(mesh.points[mesh.triangles][:, :, 2], axis=1) > 0
    rim[mesh.triangles[upright]] = True
    assert (~rim).sum() == 120
    assert np.abs(force[:, ~rim]).max() < 1e-12 * np.abs(force).max()


@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_rigid_motion_costs_nothing(potato, seed):
    law, _ = bound(Membrane(140.0, 0.3), potato)
    move = np.random.default_rng(seed).normal(size=(3, 1))
    moved = Rotation.random(random_state=seed).as_matrix() @ potato.points.T + move
    # strains of some 1e-15
    assert law.energy(Configuration(potato, moved), Inputs()) < 1e-25
    assert np.abs(force_at(law, potato, moved)).max() < 1e-11


def test_the_dampers_are_those_of_the_springs(potato):
    """So that a scene can swap the laws, and a dented sphere does not crumple as it rings down."""
    membrane, springs = (
        bound(law, potato)[0] for law in (Membrane(1.0, 0.3, 2.0), MassSpring(0, 2))
    )
    x, v = np.random.default_rng(0).normal(size=(2, 3, potato.n_points))
    change = force_at(membrane, potato, x, v) - force_at(membrane, potato, x)
    size = np.abs(force_at(membrane, potato, x)).max()
    np.testing.assert_allclose(change, force_at(springs, potato, x, v), atol=1e-14 * size)


@pytest.mark.parametrize("stretch", [0.3, 1.0, 3**0.5])
@pytest.mark.parametrize("poisson", [-0.5, 0.0, 1 / 3])
def test_twice_the_constant_operator_is_at_least_the_stiffness(potato, poisson, stretch):
    """So that the implicit schemes' iteration converges, to three times the area."""
    law, _ = bound(Membrane(100.0, poisson), potato)
    operator = np.kron(np.eye(3), law.majorants().stiffness.toarray())
    here = Configuration(potato, stretch * potato.points.T)
    exact = tangents.stiffness(law, here, Inputs()).toarray()
    rounding = 1e-10 * np.linalg.norm(operator, 2)
    assert np.linalg.eigvalsh(operator)[0] > -rounding
    assert np.linalg.eigvalsh(2 * operator - exact)[0] > -rounding


@pytest.mark.parametrize(
    "squeeze", [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1e-9, 1.0, 1.0], [1e4, 1e-4, 1.0]]
)
def test_no_shape_is_too_bad(potato, squeeze):
    """Flattened, collapsed or drawn out: the law is a polynomial of the positions."""
    law, _ = bound(Membrane(100.0, 0.3, 1.0), potato)
    x = np.array(squeeze)[:, None] * potato.points.T
    here = Configuration(potato, x)
    with np.errstate(all="raise", under="ignore"):
        assert np.isfinite(law.force(here, np.ones_like(x), Inputs())).all()
        assert np.isfinite(law.rates(here, np.ones_like(x), Inputs())).all()
        assert law.energy(here, Inputs()) > 0


@pytest.mark.parametrize("poisson", [-1.0, 1.0, 1.5])
def test_poissons_ratio_has_bounds(poisson):
    with pytest.raises(ParameterError, match=r"Membrane\.poisson_ratio = .*expected (more|less)"):
        Membrane(100.0, poisson)
