"""The constant iteration matrix of the implicit schemes against exact tangents, squeezed or not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softbody_core import (
    SDIRK2,
    AirwayResistance,
    InternalPressure,
    MassSpring,
    PinnedPoints,
    SoftBody,
    SoftBodyModel,
    State,
    VelocityVerlet,
    Weights,
    icosphere,
)
from softbody_core.configuration import Configuration
from softbody_core.integrators import Counters
from softbody_core.integrators.constant_operator import ConstantOperator
from softbody_core.integrators.quasi_newton import QuasiNewton
from softbody_core.state import Inputs
from tests.core import tangents
from tests.core.forces import deformed

ALPHA = 2.5
CRUSHED = 0.3


def springs(mesh, constraints=()):
    return SoftBodyModel(
        mesh, 0.5, [MassSpring(100.0, 0.2)], Weights(alpha=ALPHA), constraints=constraints
    )


def matrices(model, z, positions):
    """M + z² K̄ + z C̄, and the exact M + z² K + z C, both (3n, 3n)."""
    operator = ConstantOperator(model, Counters())
    masses = np.diag(model.masses)
    constant = masses + z * z * operator.stiffness.toarray() + z * operator.damping.toarray()
    weight, bound = model.terms[0]
    here = Configuration(model.mesh, positions)
    stiffness = weight * tangents.stiffness(bound, here, Inputs()).toarray()
    damping = weight * tangents.damping(bound, here, 0 * positions, Inputs()).toarray()
    exact = np.kron(np.eye(3), masses) + z * z * stiffness + z * damping
    return np.kron(np.eye(3), constant), exact


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    squeeze=st.floats(0.05, 3.0),
    logarithm=st.floats(-5, 0),
)
def test_the_matrix_is_definite_and_at_least_the_exact_one(potato, seed, squeeze, logarithm):
    """Steps from 10 µs, where mass rules, to 1 s, where springs do."""
    positions = squeeze * deformed(potato, np.random.default_rng(seed))
    constant, exact = matrices(springs(potato), 10.0**logarithm, positions)
    size = np.linalg.norm(constant, 2)
    least = 0.5 * potato.point_areas.min() / potato.area  # of the masses
    rounding = 1e-12 * size  # eigenvalues of 126 rows and the sums before them, some 1e-14 each
    assert np.linalg.eigvalsh(constant)[0] > least - rounding
    assert np.linalg.eigvalsh(constant - exact)[0] > -rounding


def test_the_exact_matrix_of_a_squeezed_body_is_not_definite(potato):
    """Or there would be nothing to stand in for: at 10 ms and 30 % of all lengths."""
    _, exact = matrices(springs(potato), 0.01, CRUSHED * np.ascontiguousarray(potato.points.T))
    assert np.linalg.eigvalsh(exact)[0] < 0


@pytest.mark.parametrize("pinned", [(), (3, 7, 20)], ids=["free", "pinned"])
def test_the_operator_solves_with_that_matrix(potato, pinned):
    model, z = springs(potato, [PinnedPoints(pinned)] if pinned else []), 0.02
    constant, _ = matrices(model, z, np.ascontiguousarray(potato.points.T))
    free = np.tile(model.inverse_masses > 0, 3)
    b = np.random.default_rng(0).normal(size=(3, potato.n_points))
    expected = np.zeros(b.size)
    expected[free] = np.linalg.solve(constant[np.ix_(free, free)], b.ravel()[free])
    actual = ConstantOperator(model, Counters()).solve((1.0, z * z, z), b).ravel()
    # condition below 1e4
    np.testing.assert_allclose(actual, expected, atol=1e-11 * np.abs(expected).max())


def crushed(laws):
    """Model, and positions near 30 % of all edges' lengths: k_s (1 − 1/0.3) = −2.3 k_s across."""
    mesh = icosphere(2, 0.084)
    noise = 0.02 * mesh.edge_lengths.mean() * np.random.default_rng(1).normal(size=(3, 162))
    return SoftBodyModel(mesh, 1.0, laws), CRUSHED * (mesh.points.T + noise)


INPUTS = Inputs(delta_p=500.0, n=1000.0)
LAWS = [MassSpring(375.0, 0.1), InternalPressure(2e-3), AirwayResistance(1e6)]


@pytest.mark.parametrize(("z", "iterations"), [(1e-4, 3), (3e-4, 10), (1e-3, 40)])
def test_a_stage_of_a_crushed_body_converges_to_its_equation(z, iterations):
    """Longer stages need not have one solution: a squeezed net folds either way."""
    model, x = crushed(LAWS)
    still, solver = np.zeros_like(x), QuasiNewton(model, iterations, Counters())
    linearization = solver.linearize(x, still, z, INPUTS)
    tolerance = 0.01 * 1e-3 * 0.084  # as the schemes ask for by default
    stage = solver.solve(x, still, still, linearization, INPUTS, tolerance)
    assert stage.converged
    here = Configuration(model.mesh, stage.positions)
    left = z * model.total_force(here, stage.velocities, INPUTS) - model.masses * stage.velocities
    # what is left of the equation would still move the body by no more than that
    assert z * np.sqrt(3 * np.mean(linearization.solve(left) ** 2)) < tolerance
    # and it is no small part of the equation that had to be solved
    assert z * np.sqrt(3 * np.mean(stage.velocities**2)) > 10 * tolerance


@pytest.mark.parametrize("laws", [LAWS[:1], LAWS], ids=["springs", "all"])
def test_a_crushed_body_goes_where_an_explicit_scheme_takes_it(laws):
    """It springs back, and crumples: 30 ms, with one step of 3 ms after another."""
    model, x = crushed(laws)

    def volumes(integrator):
        body = SoftBody(model, integrator)
        body.state = State(0.0, x, np.zeros_like(x))
        steps = [(0.003, INPUTS.delta_p, INPUTS.n)] * 10
        return np.array(
            [body.step(*step).volume for step in steps]
        ) / model.mesh.volume, body.counters

    exact, _ = volumes(VelocityVerlet(max_substep=1e-5))  # (ωh)²/24 = 1e-6 of its oscillations
    close, _ = volumes(SDIRK2(tolerance=1e-5, max_iterations=50))
    usual, work = volumes(SDIRK2())
    # errors add up over some 150 steps, and folds that grow by e in 2 ms amplify them: a few
    # hundred tolerances over rest volumes of up to 1.7, for a tolerance of 1e-5
    np.testing.assert_allclose(close, exact, atol=3e-3)
    np.testing.assert_allclose(usual, exact, atol=0.1)
    assert np.ptp(exact) > 0.08
    # no more than ten steps of 0.3 ms in 3 ms: it does not creep
    assert 10 < work.steps < 100
