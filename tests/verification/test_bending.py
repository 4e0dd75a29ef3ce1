"""Hinges against plate theory, the buckling of a sphere, and folds that nobody wants."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from softbody_core import (
    INTEGRATORS,
    Bending,
    InternalPressure,
    MassSpring,
    Membrane,
    SoftBody,
    SoftBodyModel,
    State,
    Weights,
    icosphere,
)
from softbody_core.configuration import Configuration
from softbody_core.state import Inputs
from tests.core import tangents
from tests.core.forces import bound, deformed, force_at
from tests.verification.sheets import lattice, slab

seeds = st.integers(0, 2**32 - 1)

RIGIDITY = 0.7
LAW = Bending(RIGIDITY)


@settings(max_examples=20, deadline=None)
@given(
    curvatures=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
    direction=st.floats(0, np.pi),
)
def test_a_bent_net_of_equilateral_triangles_is_a_plate(curvatures, direction):
    """½ D (κ₁² + κ₂² + 2ν κ₁κ₂) per area with ν = −1/3, whatever the directions of κ₁ and κ₂.

    Cylinders, spheres and saddles among them. Every hinge counts for a third of its two triangles;
    those of the rim, which see more than the sheet, are left out.
    """
    mesh = slab(lattice(5))
    law, _ = bound(LAW, mesh)
    bending = 1e-4  # heights of a few 1e-4 m; angles and areas change with the square of that
    axes = np.array(
        [[np.cos(direction), np.sin(direction)], [-np.sin(direction), np.cos(direction)]]
    )
    x = mesh.points.T.copy()
    x[2] += bending * 0.5 * np.sum(np.array(curvatures)[:, None] * (axes @ x[:2]) ** 2, axis=0)
    bend = law._bend(law._hinges.move_to(Configuration(mesh, x)))
    corners = np.concatenate([mesh.edges, mesh.edge_wings], axis=1)
    inside = np.ptp(mesh.points[corners][:, :, 2], axis=1) == 0
    area = np.sqrt(3) / 2 * 0.2**2 / 3 * inside.sum()
    first, second = bending * np.array(curvatures)
    # hinges in the three directions of the net count alike up to those along the rim
    density = 0.5 * RIGIDITY * np.sum((law._weights * bend**2)[inside]) / area
    expected = 0.5 * RIGIDITY * (first**2 + second**2 - 2 / 3 * first * second)
    assert density == pytest.approx(expected, rel=1e-6, abs=1e-6 * bending**2)


def bump_error(rings, uneven=0.0):
    """Energy of a bump over that of a plate, less one; points are up to `uneven` edges off."""
    height, reach = 1e-4, 0.8  # slopes of 1e-4: what is not linear is 1e-8
    points = lattice(rings)
    inside = np.linalg.norm(points, axis=1) < reach
    off = np.random.default_rng(1).uniform(-1, 1, size=(inside.sum(), 2))
    points[inside] += uneven / rings * off
    mesh = slab(points)
    law, _ = bound(LAW, mesh)
    x = mesh.points.T.copy()
    r2 = (x[0] ** 2 + x[1] ** 2) / reach**2
    x[2] += height * np.maximum(1 - r2, 0) ** 4
    # with q = r²/b², the Laplacian of (1 − q)⁴ is (4/b²) d/dq [q d/dq (1 − q)⁴]
    laplacian = lambda q: 16 * height / reach**2 * (1 - q) ** 2 * (4 * q - 1)  # noqa: E731
    integral = np.pi * reach**2 * quad(lambda q: laplacian(q) ** 2, 0, 1)[0]
    # two sheets, ½ D ∫ (Δw)² each: the Gaussian curvature of a bump sums to nothing
    return law.energy(Configuration(mesh, x), Inputs()) / (RIGIDITY * integral) - 1


def test_the_energy_of_a_bump_converges_to_a_plates_at_second_order():
    coarse, fine = bump_error(12), bump_error(24)
    assert abs(fine) < 0.02
    assert np.log2(coarse / fine) == pytest.approx(2, abs=0.15)


@pytest.mark.parametrize("rings", [12, 24])
def test_an_uneven_net_is_stiffer_however_fine(rings):
    """As the law's text says; a limit of discrete shells, not of this code."""
    assert 0.04 < bump_error(rings, 0.2) < 0.09


@settings(max_examples=10, deadline=None)
@given(seed=seeds, size=st.floats(0.1, 10))
def test_rigid_motion_and_growth_cost_nothing(potato, seed, size):
    generator = np.random.default_rng(seed)
    law, _ = bound(Bending(0.3, 0.1), potato)
    turn = Rotation.random(random_state=seed).as_matrix()
    moved = size * (turn @ potato.points.T) + generator.normal(size=(3, 1))
    assert law.energy(Configuration(potato, moved), Inputs()) < 1e-24
    # moments of 1e-15 N·m on arms of 1 mm and more
    assert np.abs(force_at(law, potato, moved)).max() < 1e-10
    x, spin = deformed(potato, generator), generator.normal(size=3)
    similar = np.cross(spin, x.T).T + generator.normal() * x + generator.normal(size=(3, 1))
    change = force_at(law, potato, x, similar) - force_at(law, potato, x)
    other = force_at(law, potato, x, generator.normal(size=x.shape)) - force_at(law, potato, x)
    assert np.abs(change).max() < 1e-10 * np.abs(other).max()


def test_a_hinge_that_folds_through_itself_meets_no_step(tetrahedron):
    """The corner above a face sinks through it: three hinges pass from π to −π."""
    law, _ = bound(LAW, tetrahedron)
    top = tetrahedron.points[3]
    others = tetrahedron.points[:3].mean(axis=0)

    def at(depth):
        x = tetrahedron.points.T.copy()
        x[:, 3] = others + depth * (top - others)
        return Configuration(tetrahedron, x)

    angles = [law._hinges.move_to(at(depth)).angle for depth in (1e-6, -1e-6)]
    assert (np.abs(angles[0] - angles[1]) > 6).sum() == 3
    above, below = (law.energy(at(depth), Inputs()) for depth in (1e-6, -1e-6))
    # by the force at most: (dθ = 3√2 dz) · moment, of six hinges that are bent by less than π
    assert abs(above - below) < 1e-4 * above
    assert np.abs(force_at(law, tetrahedron, at(1e-9).positions)).max() < 100 * RIGIDITY


@pytest.mark.parametrize("law", [Bending(0.3, 0.1)], ids=repr)
@pytest.mark.parametrize("bad", ["point", "flat", "line", "edge", "wing on its edge", "far away"])
def test_no_shape_is_too_bad(potato, law, bad):
    """A triangle that collapses has no normal: it does not turn, and nothing is infinite."""
    force, _ = bound(law, potato)
    x = potato.points.T.copy()
    a, b, c = potato.triangles[0]
    match bad:
        case "point":
            x[:] = 0
        case "flat":
            x[2] = 0
        case "line":
            x[1:] = 0
        case "edge":
            x[:, a] = x[:, b]
        case "wing on its edge":
            x[:, c] = 0.3 * x[:, a] + 0.7 * x[:, b]
        case "far away":
            x[:, a] *= 1e8
    here = Configuration(potato, x)
    with np.errstate(all="raise", under="ignore"):
        assert np.isfinite(force.force(here, np.ones_like(x), Inputs())).all()
        assert np.isfinite(force.energy(here, Inputs()))
        assert np.isfinite(force.rates(here, np.ones_like(x), Inputs())).all()


def test_damping_is_stiffness_times_relaxation_time_at_rest(potato):
    law, _ = bound(Bending(0.4, 0.02), potato)
    rest = Configuration(potato, np.ascontiguousarray(potato.points.T))
    stiffness = tangents.stiffness(law, rest, Inputs())
    damping = tangents.damping(law, rest, np.zeros_like(rest.positions), Inputs())
    difference = damping - 0.05 * stiffness
    assert abs(difference).max() < 1e-12 * abs(stiffness).max()


def test_twice_the_constant_operator_is_at_least_the_stiffness_at_rest(potato):
    law, _ = bound(LAW, potato)
    operator = np.kron(np.eye(3), law.majorants().stiffness.toarray())
    rest = Configuration(potato, np.ascontiguousarray(potato.points.T))
    exact = tangents.stiffness(law, rest, Inputs()).toarray()
    rounding = 1e-12 * np.linalg.norm(operator, 2)
    assert np.linalg.eigvalsh(operator)[0] > -rounding
    assert np.linalg.eigvalsh(2 * operator - exact)[0] > -rounding


def tangent(model, here, inputs):
    """Stiffness of all laws, (3n, 3n)."""
    parts = [weight * tangents.stiffness(law, here, inputs) for weight, law in model.terms]
    return sum(parts[1:], start=parts[0])


@pytest.mark.slow
def test_a_sphere_buckles_at_its_classical_pressure():
    """p = 4 √(Y D)/R² (Zoelly 1915), which has membrane and bending in it alike.

    The theory is that of small strains; here the sphere is 2 % smaller when it buckles, and the
    law is 6 % softer then (its slope is (3s² − 1)/2), which leaves √0.94 of it.
    """
    young, rigidity, poisson = 1.0, 3e-4, 1 / 3
    mesh = icosphere(3)
    laws = [Membrane(young, poisson), Bending(rigidity), InternalPressure(0.0)]
    model = SoftBodyModel(mesh, 1.0, laws)
    classical = 4 * np.sqrt(young * rigidity)

    def lowest(pressure):
        """Smallest eigenvalue beside the six of rigid motion, under a pressure from outside."""
        inputs, x = Inputs(delta_p=-pressure), (1 - pressure * (1 - poisson) / 2) * mesh.points.T
        for _ in range(8):
            here = Configuration(mesh, x)
            force = model.force(here, np.zeros_like(x), inputs)
            still = tangent(model, here, inputs) + 1e-6 * young * sp.eye_array(x.size)
            x = x + spsolve(sp.csc_matrix(still), force.ravel()).reshape(x.shape)
        assert np.abs(force).max() < 1e-5 * pressure * mesh.point_areas.min()
        stiffness = tangent(model, Configuration(mesh, x), inputs).toarray()
        values = scipy.linalg.eigvalsh(stiffness, subset_by_index=[0, 6])
        return values[np.argsort(np.abs(values))[6]]

    assert lowest(0.92 * classical) > 0
    assert lowest(0.98 * classical) < 0


@pytest.mark.parametrize(
    "structure", [MassSpring(375.0, 0.1), Membrane(433.0, 1 / 3, 0.1)], ids=repr
)
@pytest.mark.parametrize("stiffness", [1e-3, 1.0], ids=lambda d: f"D={d:g}")
def test_stiff_hinges_go_with_implicit_schemes(structure, stiffness):
    """A dented sphere springs back in few iterations, with hinges a thousand times stiffer too."""
    mesh = icosphere(2, 0.084)
    laws = [structure, Bending(stiffness, 1e-3 * stiffness), InternalPressure(0.0)]
    body = SoftBody(SoftBodyModel(mesh, 1.0, laws), INTEGRATORS["sdirk2"]())
    dent = 1 - 0.1 * np.exp(-((mesh.points[:, 2] / 0.084 - 1) ** 2) / 0.1)
    body.state = State(0.0, dent * mesh.points.T, np.zeros((3, mesh.n_points)))
    for _ in range(30):
        body.step(1 / 30)
    bend = bound(LAW, mesh)[0]
    left = bend.energy(Configuration(mesh, body.state.positions), Inputs())
    assert left < 1e-2 * bend.energy(Configuration(mesh, dent * mesh.points.T), Inputs())
    assert body.counters.force_evaluations < 20 * body.counters.steps
    assert body.counters.steps < 1000


def test_alpha_weighs_hinges_and_membrane_alike():
    mesh = icosphere(1)
    x = deformed(mesh, np.random.default_rng(0))
    laws = [Membrane(433.0), LAW]

    def force(alpha):
        model = SoftBodyModel(mesh, 1.0, laws, Weights(alpha=alpha))
        return model.force(Configuration(mesh, x), np.zeros_like(x), Inputs())

    np.testing.assert_allclose(force(3.0), 3 * force(1.0), rtol=1e-13)
