"""The body and its integrators, parametrised over the table of schemes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softbody_core import (
    INTEGRATORS,
    AirwayResistance,
    DivergenceError,
    Gravity,
    InternalPressure,
    MassSpring,
    ParameterError,
    PinnedTop,
    SoftBody,
    SoftBodyModel,
    StepLimitError,
    SurfaceSPH,
    VelocityVerlet,
    Weights,
    fibonacci_sphere,
)
from softbody_core.configuration import Configuration

each_scheme = pytest.mark.parametrize("scheme", INTEGRATORS.values(), ids=INTEGRATORS)

LAWS = [
    MassSpring(200.0, 0.2),
    SurfaceSPH(30.0, 0.5),
    InternalPressure(1e-3),
    Gravity(),
    AirwayResistance(5e5),
]


def lung_like(scheme, n_points=60, **options):
    mesh = fibonacci_sphere(n_points, 0.08)
    model = SoftBodyModel(mesh, 0.5, LAWS, Weights(delta=0.1), [PinnedTop(0.02)])
    return SoftBody(model, scheme(**options))


inputs = st.tuples(st.floats(-80, 400), st.floats(0, 20_000))


@each_scheme
@settings(max_examples=5, deadline=None)
@given(
    before=st.lists(inputs, min_size=1, max_size=3), after=st.lists(inputs, min_size=2, max_size=4)
)
def test_restoring_repeats_to_the_bit(scheme, before, after):
    body = lung_like(scheme)
    for delta_p, n in before:
        body.step(0.02, delta_p, n)
    saved = body.get_state()
    first = [body.step(0.02, delta_p, n) for delta_p, n in after]
    positions, velocities, steps = body.positions, body.velocities, body.counters
    body.set_state(saved)
    again = [body.step(0.02, delta_p, n) for delta_p, n in after]
    twin = lung_like(scheme)
    twin.set_state(saved)
    elsewhere = [twin.step(0.02, delta_p, n) for delta_p, n in after]
    for one, two, three in zip(first, again, elsewhere, strict=True):
        assert one.volume == two.volume == three.volume
        assert one.flow == two.flow == three.flow
    np.testing.assert_array_equal(body.positions, positions)
    np.testing.assert_array_equal(body.velocities, velocities)
    np.testing.assert_array_equal(twin.positions, positions)
    assert body.counters == twin.counters == steps


@each_scheme
def test_a_step_reports_what_the_geometry_says(scheme):
    body = lung_like(scheme)
    seen = body.step(0.03, delta_p=300.0, n=5000.0)
    here = Configuration(body.model.mesh, body.state.positions)
    assert seen.time == pytest.approx(0.03, rel=1e-15)
    assert seen.volume == here.volume
    np.testing.assert_array_equal(seen.bounding_box[0], body.positions.min(axis=0))
    np.testing.assert_array_equal(seen.bounding_box[1], body.positions.max(axis=0))
    extent = seen.bounding_box[1] - seen.bounding_box[0]
    assert seen.bounding_box_volume == pytest.approx(np.prod(extent), rel=1e-15)
    assert seen.pressure == pytest.approx(1e-3 * 5000 / np.prod(extent) + 300, rel=1e-13)
    assert seen.alveolar_pressure == pytest.approx(seen.pressure - 5e5 * seen.flow, rel=1e-13)


@each_scheme
def test_flow_is_the_rate_of_the_volume(scheme):
    body = lung_like(scheme)
    body.step(0.02, delta_p=300.0)
    before = body.observe()
    h = 1e-5
    after = body.step(h, delta_p=300.0)
    mean = 0.5 * (before.flow + after.flow)
    # the trapezoid of a smooth flow over 1e-5 s; second differences are below 1e-4 of it
    assert (after.volume - before.volume) / h == pytest.approx(mean, rel=1e-3)


@each_scheme
def test_pins_do_not_move(scheme):
    body = lung_like(scheme)
    held = PinnedTop(0.02).held(body.model.mesh)
    body.step(0.1, delta_p=300.0)
    np.testing.assert_array_equal(body.positions[held], body.model.mesh.points[held])
    assert np.abs(body.positions[~held] - body.model.mesh.points[~held]).max() > 1e-3


@each_scheme
def test_a_body_at_rest_stays_at_rest(scheme):
    model = SoftBodyModel(fibonacci_sphere(60, 0.08), 0.5, [LAWS[0], LAWS[1], LAWS[2], LAWS[4]])
    body = SoftBody(model, scheme())
    rest = body.observe().volume
    # Lengths and densities are those at rest but for roundings, and so is the volume: 1e-12 is
    # what quasi-static solves it to. A force of a millionth of the springs' would show 1e-8.
    assert body.step(0.5).volume == pytest.approx(rest, rel=1e-12)


@each_scheme
def test_what_blows_up_is_named_and_the_body_stays_where_it_was(scheme):
    body = lung_like(scheme)
    body.step(0.02, delta_p=200.0)
    saved = body.get_state()
    with pytest.raises((DivergenceError, StepLimitError)) as caught:
        body.step(5.0, delta_p=1e9)
    assert "try" in str(caught.value).lower()
    np.testing.assert_array_equal(body.state.positions, saved.state.positions)
    assert (body.time, body.counters.steps) == (saved.state.time, saved.counters.steps)
    # and it can go on
    assert np.isfinite(body.step(0.02, delta_p=200.0).volume)


@pytest.mark.parametrize("name", ["symplectic-euler", "velocity-verlet", "rk4"])
def test_beyond_the_stability_limit_comes_a_named_error(name):
    """Inside the estimated limit a kicked body stays bounded; well beyond, it is named."""
    mesh = fibonacci_sphere(60, 0.08)

    def run(safety):
        model = SoftBodyModel(mesh, 0.5, [MassSpring(200.0)])
        body = SoftBody(model, INTEGRATORS[name](safety=safety))
        kick = 0.05 * np.random.default_rng(0).normal(size=(3, 60))
        body.state = type(body.state)(0.0, body.state.positions, kick)
        for _ in range(20):
            body.step(0.5)
        return body

    assert np.abs(run(0.99).positions).max() < 0.2
    with pytest.raises(DivergenceError) as caught:
        run(1.6)
    assert caught.value.time > 0
    assert "diverged at t =" in str(caught.value)
    assert "Try a smaller step" in str(caught.value)


def test_a_runaway_volume_is_an_error():
    body = SoftBody(
        SoftBodyModel(fibonacci_sphere(60, 0.01), 0.5, [MassSpring(0.01), InternalPressure(0.0)])
    )
    with pytest.raises(DivergenceError, match="volume over rest volume became"):
        body.step(100.0, delta_p=1e3)


def test_a_collapse_is_an_error():
    body = SoftBody(
        SoftBodyModel(
            fibonacci_sphere(60, 0.08), 0.5, [MassSpring(1.0, 0.1), InternalPressure(1e-3)]
        )
    )
    with pytest.raises(DivergenceError, match="collapsed"):
        body.step(4.0, delta_p=-3e3)


def test_too_many_substeps_are_refused_before_they_are_taken():
    body = lung_like(VelocityVerlet, max_substeps=10)
    with pytest.raises(StepLimitError, match="max_substeps = 10 allows; try"):
        body.step(10.0)


@pytest.mark.parametrize("dt", [0.0, -0.1, np.nan, np.inf])
def test_dt_has_to_be_positive(dt):
    body = lung_like(VelocityVerlet)
    with pytest.raises(ParameterError, match="dt = "):
        body.step(dt)


@pytest.mark.parametrize(("name", "value"), [("delta_p", np.nan), ("n", np.inf), ("n", -1.0)])
def test_inputs_have_to_make_sense(name, value):
    body = lung_like(VelocityVerlet)
    with pytest.raises(ParameterError, match=rf"Inputs\.{name} = "):
        body.step(0.01, **{name: value})
    assert body.time == 0


def test_a_body_restores_only_its_own_kind():
    saved = lung_like(VelocityVerlet, 60).get_state()
    with pytest.raises(ParameterError, match="60 points, this one has 50"):
        lung_like(VelocityVerlet, 50).set_state(saved)
