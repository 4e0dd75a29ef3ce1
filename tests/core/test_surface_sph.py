"""SPH against loops that are written straight from the equations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from softbody_core import CrowdedError, SurfaceSPH, fibonacci_sphere
from softbody_core.configuration import Configuration
from softbody_core.neighbours import SKIN, NeighbourList
from softbody_core.state import Inputs
from tests.core.forces import bound, deformed, force_at


def poly6(r, h):
    return 315 / (64 * np.pi * h**9) * (h**2 - r**2) ** 3 if r <= h else 0.0


def spiky_slope(r, h):
    return -45 / (np.pi * h**6) * (h - r) ** 2 if r <= h else 0.0


def viscosity_laplacian(r, h):
    return 45 / (np.pi * h**6) * (h - r) if r <= h else 0.0


def test_kernels_integrate_to_one():
    """Müller et al. 2003: each kernel is normalised over the ball of radius h."""
    h = 0.7
    shell = quad(lambda r: 4 * np.pi * r**2 * poly6(r, h), 0, h)[0]
    assert shell == pytest.approx(1, rel=1e-10)
    # spiky W = ∫ slope; by parts its integral is −(4π/3) ∫ r³ W' dr
    spiky = quad(lambda r: -4 / 3 * np.pi * r**3 * spiky_slope(r, h), 0, h)[0]
    assert spiky == pytest.approx(1, rel=1e-10)
    # the viscosity kernel W = −r³/2h³ + r²/h² + h/2r − 1, times 15/(2πh³), has this Laplacian
    laplacian_mass = quad(lambda r: r**4 * viscosity_laplacian(r, h) * 4 * np.pi / 6, 0, h)[0]
    assert laplacian_mass == pytest.approx(1, rel=1e-10)


def loops(law, mesh, masses, x, v):
    """Equations 5 to 9, one pair at a time, in newtons."""
    h = law.core_radius * mesh.edge_lengths.mean()
    n = mesh.n_points

    def densities(points):
        distance = np.linalg.norm(points[:, None] - points[None], axis=2)
        return np.array(
            [sum(masses[j] * poly6(distance[i, j], h) for j in range(n)) for i in range(n)]
        )

    rho, rest = densities(x), law.rest_density * densities(mesh.points)
    pressure = law.gas_constant * (rho - rest)
    sign = 1 if law.pressure == "sum" else -1
    force = np.zeros((n, 3))
    for i in range(n):
        for j in range(n):
            r = np.linalg.norm(x[i] - x[j])
            if i == j or r > h:
                continue
            gradient = spiky_slope(r, h) * (x[i] - x[j]) / r
            density = -masses[j] * (pressure[i] + sign * pressure[j]) / (2 * rho[j]) * gradient
            density = density + law.viscosity * masses[j] * (v[j] - v[i]) / rho[
                j
            ] * viscosity_laplacian(r, h)
            force[i] += masses[i] / rho[i] * density
    return force.T


@pytest.mark.parametrize("pressure", ["sum", "difference"])
@settings(max_examples=5, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), core_radius=st.floats(0.5, 4))
def test_force_agrees_with_loops(potato, pressure, seed, core_radius):
    generator = np.random.default_rng(seed)
    law = SurfaceSPH(40.0, 0.9, core_radius, rest_density=0.6, pressure=pressure)
    force, masses = bound(law, potato)
    x, v = deformed(potato, generator), generator.normal(size=(3, potato.n_points))
    expected = loops(law, potato, masses, x.T, v.T)
    actual = force_at(force, potato, x, v)
    np.testing.assert_allclose(actual, expected, atol=1e-11 * max(np.abs(expected).max(), 1e-3))


def test_points_at_one_place_give_a_finite_force(potato):
    force, _ = bound(SurfaceSPH(30.0, 1.0), potato)
    x = np.ascontiguousarray(potato.points.T)
    x[:, 3] = x[:, 4]
    assert np.isfinite(force_at(force, potato, x)).all()


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_an_old_list_gives_the_same_bits_as_a_new_one(seed):
    """Otherwise a restored body would not repeat itself exactly."""
    mesh = fibonacci_sphere(100, 0.1)
    generator = np.random.default_rng(seed)
    old, masses = bound(SurfaceSPH(30.0, 0.5), mesh)
    new = SurfaceSPH(30.0, 0.5).bind(mesh, masses)
    h = 2 * mesh.edge_lengths.mean()
    moved = np.ascontiguousarray(mesh.points.T)
    moved = moved + 0.28 * SKIN * h * generator.uniform(-1, 1, size=moved.shape)
    new._neighbours = NeighbourList(h)
    v = generator.normal(size=moved.shape)
    kept = old._neighbours.pairs(moved)
    assert kept is old._neighbours.pairs(np.ascontiguousarray(mesh.points.T))
    fresh = new._neighbours.pairs(moved)
    # the two lists differ, or this would show nothing
    assert set(zip(kept.first, kept.second, strict=True)) != set(
        zip(fresh.first, fresh.second, strict=True)
    )
    here = Configuration(mesh, moved)
    np.testing.assert_array_equal(old.force(here, v, Inputs()), new.force(here, v, Inputs()))


def test_the_list_follows_points_that_move_far():
    x = np.zeros((3, 2))
    x[0, 1] = 10.0
    neighbours = NeighbourList(1.0)
    assert len(neighbours.pairs(x).first) == 0
    x = x.copy()
    x[0, 1] = 0.9
    assert len(neighbours.pairs(x).first) == 1


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), stretch=st.floats(0.7, 2.0), noise=st.floats(0, 0.2))
def test_the_list_never_misses_a_neighbour(seed, stretch, noise):
    """Breathing, turning and shaking bodies, against all distances."""
    mesh = fibonacci_sphere(60, 0.1)
    generator = np.random.default_rng(seed)
    rest = np.ascontiguousarray(mesh.points.T)
    h = 2 * mesh.edge_lengths.mean()
    neighbours = NeighbourList(h)
    neighbours.pairs(rest)
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    stretches = stretch ** generator.uniform(-1, 1, size=(3, 1))
    moved = turn @ (stretches * rest) + noise * h * generator.uniform(-1, 1, size=rest.shape)
    found = neighbours.pairs(moved)
    distances = np.linalg.norm(moved[:, :, None] - moved[:, None], axis=0)
    near = {(i, j) for i, j in np.argwhere(distances < h).tolist() if i < j}
    assert near <= set(zip(found.first.tolist(), found.second.tolist(), strict=True))


def test_a_body_that_only_swells_and_turns_keeps_its_list():
    mesh = fibonacci_sphere(60, 0.1)
    rest = np.ascontiguousarray(mesh.points.T)
    neighbours = NeighbourList(2 * mesh.edge_lengths.mean())
    first = neighbours.pairs(rest)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    assert neighbours.pairs(1.3 * turn @ rest + 0.5) is first
    assert neighbours.pairs(0.8 * rest) is not first


def test_a_heap_of_points_is_refused_before_it_fills_the_memory():
    mesh = fibonacci_sphere(400, 0.1)
    rest = np.ascontiguousarray(mesh.points.T)
    neighbours = NeighbourList(0.7 * mesh.edge_lengths.mean())
    neighbours.pairs(rest)
    with pytest.raises(CrowdedError, match=r"79800 pairs among 400 points .* Try more pressure"):
        neighbours.pairs(1e-3 * rest)
