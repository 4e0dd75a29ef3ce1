from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from softbody_core import ParameterError, RigidBody, RigidState, SurfaceMesh, icosphere

G = 9.80665


def box(sides, centre=(0.0, 0.0, 0.0)):
    """A box as a closed mesh."""
    made = trimesh.creation.box(sides)
    return SurfaceMesh.from_arrays(made.vertices + centre, made.faces)


BRICK = box((0.1, 0.2, 0.3))


def after(body, time, steps=1):
    """State after free motion."""
    state = body.start()
    for _ in range(steps):
        state = body.advance(state, time / steps)
    return state


def angular_momentum(body, state):
    return state.rotation @ body.inertia @ state.rotation.T @ state.angular_velocity


@pytest.mark.parametrize("steps", [1, 7, 1000])
def test_free_fall_and_a_force_at_the_centre_are_exact(steps):
    velocity, force = np.array([1.0, -2.0, 3.0]), np.array([0.3, 0.1, -0.2])
    body = RigidBody(BRICK, "free", 0.5, tuple(velocity), force=tuple(force))
    acceleration = force / 0.5 - [0, 0, G]
    state = after(body, 2.0, steps)
    # rounding of at most `steps` additions of numbers of this size
    np.testing.assert_allclose(state.velocity, velocity + 2 * acceleration, atol=1e-12)
    place = 2 * velocity + 2 * acceleration
    np.testing.assert_allclose(state.position, place, atol=1e-11)
    np.testing.assert_array_equal(state.rotation, np.eye(3))  # at the centre, so no torque


def test_a_top_without_torque_keeps_its_angular_momentum_and_stays_rigid():
    body = RigidBody(BRICK, "free", 2.0, angular_velocity=(3.0, 20.0, -4.0))
    start = angular_momentum(body, body.start())
    state = after(body, 10.0, 5000)
    # The rotation is one but for some 100 roundings, a random walk of 5000 steps, and each step
    # hands the momentum on through it: 5000 × 2e-14.
    np.testing.assert_allclose(state.rotation @ state.rotation.T, np.eye(3), atol=1e-13)
    np.testing.assert_allclose(angular_momentum(body, state), start, rtol=1e-10)


def precession_error(steps):
    """Error of the axis of a symmetric body, against the closed form.

    L is constant; the axis turns about L at the rate |L|/I₁, where I₁ is the inertia across it.
    """
    body = RigidBody(box((0.1, 0.1, 0.3)), "free", 1.0, angular_velocity=(1.0, 0.0, 8.0))
    across = body.inertia[0, 0]
    momentum = angular_momentum(body, body.start())
    axis = Rotation.from_rotvec(2.0 * momentum / across).as_matrix() @ [0, 0, 1.0]
    return np.linalg.norm(after(body, 2.0, steps).rotation[:, 2] - axis)


def test_a_symmetric_top_precesses_as_the_closed_form_says_and_at_second_order():
    errors = [precession_error(steps) for steps in (100, 200, 400, 800)]
    # each of 800 steps turns by 0.02 rad and errs by its cube over 24 at most
    assert errors[-1] < 800 * 0.02**3 / 24
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


def test_an_uneven_top_keeps_its_energy_to_second_order():
    """Spin near the middle axis is unstable (Dzhanibekov): the body tumbles, energy stays."""
    body = RigidBody(BRICK, "free", 1.0, angular_velocity=(0.01, 10.0, 0.01))

    def drift(steps):
        state, energies, tilted = body.start(), [], []
        for _ in range(steps):
            state = body.advance(state, 4.0 / steps)
            energies.append(angular_momentum(body, state) @ state.angular_velocity / 2)
            tilted.append(state.rotation[1, 1])
        assert min(tilted) < -0.9  # it did turn over
        return np.ptp(energies) / energies[0]

    coarse, fine = drift(800), drift(1600)
    assert fine < 1e-3
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.2)


def test_a_driven_body_keeps_its_velocities_whatever_pulls():
    body = RigidBody(BRICK, "driven", 0.1, (0, 0, -1.0), (0, 0, np.pi), force=(9.0, 0, 0))
    state = after(body, 0.5, 10)
    np.testing.assert_allclose(state.position, [0, 0, -0.5], atol=1e-14)
    np.testing.assert_allclose(state.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-14)
    np.testing.assert_array_equal(state.velocity, [0, 0, -1])
    np.testing.assert_array_equal(state.angular_velocity, [0, 0, np.pi])


def test_a_fixed_body_stays_to_the_bit():
    body = RigidBody(BRICK, force=(9.0, 0, 0))
    state = body.start()
    assert body.advance(state, 1.0) is state
    assert not body.moves


def test_its_surface_moves_with_it():
    mesh = box((0.1, 0.2, 0.3), centre=(1.0, 2.0, 3.0))
    body = RigidBody(mesh, "driven", velocity=(1.0, 0, 0), angular_velocity=(0, 0, np.pi / 2))
    np.testing.assert_allclose(body.surface(body.start()), mesh.points, atol=1e-15)
    turned = (mesh.points - [1, 2, 3]) @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    surface = body.surface(body.advance(body.start(), 1.0))
    np.testing.assert_allclose(surface, turned + np.array([2.0, 2.0, 3.0]), atol=1e-14)


def test_inertia_of_a_box():
    a, b, c = 0.1, 0.2, 0.3
    body = RigidBody(box((a, b, c), (4.0, -5.0, 6.0)), "free", 2.5)
    expected = 2.5 / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    np.testing.assert_allclose(body.inertia, expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(body.centre, [4.0, -5.0, 6.0], rtol=1e-14)


def test_inertia_of_a_ball_converges_to_that_of_the_sphere():
    """2/5 m r²; the facets of an inscribed ball lie within it, by O(edge²)."""
    errors = [
        RigidBody(icosphere(n, 0.3), "free", 2.0).inertia[0, 0] / (0.4 * 2.0 * 0.09) - 1
        for n in (2, 3, 4)
    ]
    assert -2e-3 < errors[-1] < 0
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.05)


def test_a_body_far_from_the_origin_weighs_the_same():
    near = RigidBody(icosphere(1, 0.1), "free", 1.0)
    far = RigidBody(icosphere(1, 0.1).moved([3e4, -2e4, 1e4]), "free", 1.0)
    # coordinates of 3e4 m are spaced by 4e-12 m, 4e-11 of the radius
    np.testing.assert_allclose(far.inertia, near.inertia, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(far.centre, [3e4, -2e4, 1e4], rtol=1e-14)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"motion": "free"}, "cup.mass is missing: a free body needs one"),
        ({"velocity": (0, 0, 1.0)}, 'cup is fixed and has a velocity; try motion = "driven"'),
        ({"angular_velocity": (0, 0, 1.0)}, "cup is fixed and has a velocity"),
        ({"motion": "loose"}, "cup.motion = 'loose': expected fixed, driven or free"),
        ({"force": (0.0, 1.0)}, r"cup.force = \(0.0, 1.0\): expected three numbers"),
        ({"velocity": (0.0, np.nan, 1.0)}, "cup.velocity = .*: expected three numbers"),
        ({"velocity": 1.0}, "cup.velocity = 1.0: expected three numbers"),
        ({"mass": 0.0}, "RigidBody.mass = 0 kg: expected more than 0"),
        ({"gravity": -1.0}, "RigidBody.gravity = -1"),
    ],
)
def test_what_makes_no_sense_is_named(options, said):
    with pytest.raises(ParameterError, match=said):
        RigidBody(BRICK, name="cup", **options)


def test_without_a_mass_there_is_no_inertia():
    with pytest.raises(ParameterError, match="obstacle has no mass"):
        _ = RigidBody(BRICK).inertia


def test_a_state_is_what_it_was_given():
    body = RigidBody(BRICK, "driven", velocity=(1.0, 2.0, 3.0))
    assert isinstance(body.start(), RigidState)
    np.testing.assert_array_equal(body.start().velocity, [1, 2, 3])
    np.testing.assert_array_equal(body.start().rotation, np.eye(3))
