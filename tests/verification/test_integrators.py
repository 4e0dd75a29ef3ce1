"""Declared orders, conservation, and closed forms of motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from softbody_core import (
    INTEGRATORS,
    AirwayResistance,
    Gravity,
    InternalPressure,
    MassSpring,
    SoftBody,
    SoftBodyModel,
    State,
    SurfaceSPH,
    VelocityVerlet,
    fibonacci_sphere,
    icosphere,
)
from softbody_core.configuration import Configuration
from softbody_core.integrators.explicit import ExplicitIntegrator
from softbody_core.integrators.implicit import ImplicitIntegrator
from softbody_core.state import Inputs

INPUTS = Inputs(delta_p=50.0, n=100.0)

LOOSE = {"tolerance": 10.0, "solver_accuracy": 1e-11, "max_iterations": 200}
"""Never asks for a shorter step, and solves stages far below the error."""

EQUAL_STEPS = {ExplicitIntegrator: ("max_substep", {}), ImplicitIntegrator: ("max_step", LOOSE)}
"""How integrators are made to take equal steps: the option that sets them, and further options.

By class, or by the family from which an integrator derives.
"""


def _equal_steps(name):
    kinds = INTEGRATORS[name].__mro__
    found = next((EQUAL_STEPS[kind] for kind in kinds if kind in EQUAL_STEPS), None)
    if found is None:
        pytest.fail(
            f"{name} is in INTEGRATORS, but no test knows how to make it take equal steps: derive "
            f"{kinds[0].__name__} from ExplicitIntegrator or ImplicitIntegrator, or add a line "
            f"{kinds[0].__name__}: (option that sets the step, further options) to EQUAL_STEPS in "
            "tests/verification/test_integrators.py"
        )
    return found


def is_implicit(name):
    return issubclass(INTEGRATORS[name], ImplicitIntegrator)


def with_step(name, h):
    option, others = _equal_steps(name)
    return INTEGRATORS[name](**{option: h}, **others)


@pytest.mark.parametrize("name", INTEGRATORS)
def test_every_integrator_says_its_order(name):
    kind = INTEGRATORS[name]
    assert hasattr(kind, "order"), (
        f"{name} says nothing of its order: give {kind.__name__} order: ClassVar[int | None], None "
        "if it neglects something and so converges to another motion"
    )


def wobbling(resistance):
    """A small soft body of every smooth force, set in motion; slow enough for large steps.

    The fluid's radius spans the body: the spiky kernel has a kink at its edge, and a pair that
    crossed it would hide a fourth order.
    """
    mesh = fibonacci_sphere(30, 0.08)
    laws = [
        MassSpring(20.0, 0.05),
        SurfaceSPH(3.0, 0.3, 5.0),
        InternalPressure(1e-3, "enclosed-volume"),
        Gravity(1.0),
        AirwayResistance(resistance),
    ]
    model = SoftBodyModel(mesh, 0.5, laws)
    generator = np.random.default_rng(3)
    start = State.at_rest(mesh)
    return model, State(0.0, start.positions, 0.05 * generator.normal(size=(3, 30)))


def reference(model, start, end):
    """Positions and velocities by SciPy's eighth-order scheme at tight tolerances."""

    def derivative(_, y):
        x, v = y.reshape(2, 3, -1)
        force = model.total_force(Configuration(model.mesh, x), v, INPUTS)
        return np.concatenate([v.ravel(), (model.inverse_masses * force).ravel()])

    y0 = np.concatenate([start.positions.ravel(), start.velocities.ravel()])
    solution = solve_ivp(derivative, (0, end), y0, method="DOP853", rtol=1e-12, atol=1e-14)
    return solution.y[:, -1]


ORDERED = [name for name, kind in INTEGRATORS.items() if getattr(kind, "order", None)]


@pytest.mark.parametrize("resistance", [0.0, 2e4], ids=["open", "resisting"])
@pytest.mark.parametrize("name", ORDERED)
def test_the_declared_order_is_reached(name, resistance):
    model, start = wobbling(resistance)
    end = 0.05
    exact = reference(model, start, end)
    # implicit schemes resolve the airway's resistance, which decays within 1/400 s, later
    counts = np.array([128, 256, 512] if is_implicit(name) else [32, 64, 128])
    errors = []
    for count in counts:
        body = SoftBody(model, with_step(name, end / count))
        body.state = start
        body.step(end, INPUTS.delta_p, INPUTS.n)
        assert body.counters.steps == count
        reached = np.concatenate([body.state.positions.ravel(), body.state.velocities.ravel()])
        errors.append(np.abs(reached - exact).max())
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    # regression over three step sizes; the next term of the error is still seen at the largest
    assert order == pytest.approx(INTEGRATORS[name].order, abs=0.05)


@pytest.mark.parametrize("name", ORDERED)
def test_free_fall(name):
    """x = −g t²/2 for every point; springs do not notice."""
    g = 9.80665
    model = SoftBodyModel(fibonacci_sphere(30, 0.08), 0.5, [MassSpring(20.0), Gravity()])
    body = SoftBody(model, with_step(name, 1e-3))
    body.step(0.1)
    fallen = body.positions - model.mesh.points
    h = 0.1 / body.counters.steps
    # BDF2 starts with backward Euler, whose g h²/2 it carries on 3/2-fold: 3/2 and −1/2 are the
    # shares of the roots 1 and 1/3 of its polynomial
    first = g * 0.1 * h / 2
    errors = {"symplectic-euler": first, "backward-euler": first, "bdf2": 1.5 * g * h**2 / 2}
    errors |= dict.fromkeys(["velocity-verlet", "rk4", "sdirk2"], 0.0)
    if name in errors:
        np.testing.assert_allclose(fallen[:, 2], -g * 0.1**2 / 2 - errors[name], rtol=1e-8)
    else:  # no integrator need be worse than those of first order
        np.testing.assert_allclose(fallen[:, 2], -g * 0.1**2 / 2, atol=first * (1 + 1e-6))
    np.testing.assert_allclose(fallen[:, :2], 0, atol=1e-10)


def test_a_tetrahedron_breathes_at_its_closed_frequency(tetrahedron):
    """Breathing of four masses m on six springs k: ω² = 4k/m (energy of a uniform dilation)."""
    k, mass = 50.0, 0.8
    model = SoftBodyModel(tetrahedron, mass, [MassSpring(k)])
    omega = np.sqrt(4 * k / (mass / 4))
    body = SoftBody(model, VelocityVerlet(max_substep=1e-5))
    amplitude = 1e-3
    rest = body.state.positions
    body.state = State(0.0, rest * (1 + amplitude), np.zeros_like(rest))
    period = 2 * np.pi / omega
    for quarter, expected in ((1, 0.0), (2, -1.0), (3, 0.0), (4, 1.0)):
        body.step(period / 4)
        stretch = np.vdot(rest, body.state.positions) / np.vdot(rest, rest) - 1
        # a uniform dilation keeps springs linear: what is left is the scheme's (ωh)² phase error
        assert stretch == pytest.approx(expected * amplitude, abs=1e-6 * amplitude), quarter


def test_verlet_keeps_energy_of_undamped_springs():
    model = SoftBodyModel(fibonacci_sphere(60, 0.08), 0.5, [MassSpring(100.0)])

    def drift(h):
        body = SoftBody(model, VelocityVerlet(max_substep=h))
        kick = 0.2 * np.random.default_rng(1).normal(size=(3, 60))
        body.state = State(0.0, body.state.positions, kick)
        first = model.energy(body.state, Inputs())
        energies = []
        for _ in range(50):
            body.step(0.02)
            energies.append(model.energy(body.state, Inputs()))
        return np.abs(np.array(energies) / first - 1).max()

    coarse, fine = drift(4e-4), drift(2e-4)
    # symplectic and of second order: bounded, and four times smaller at half the step
    assert coarse < 2e-3
    assert coarse / fine == pytest.approx(4, rel=0.35)


@pytest.mark.parametrize("name", ORDERED)
def test_a_free_body_keeps_its_momentum(name):
    laws = [MassSpring(100.0, 0.1), SurfaceSPH(30.0, 0.5), InternalPressure(1e-3)]
    model = SoftBodyModel(fibonacci_sphere(60, 0.08), 0.5, [*laws, AirwayResistance(1e5)])
    body = SoftBody(model, INTEGRATORS[name]())
    velocities = 0.3 * np.random.default_rng(2).normal(size=(3, 60)) + [[0.1], [0.2], [0.3]]
    body.state = State(0.0, body.state.positions, velocities)
    momentum = velocities @ model.masses
    for _ in range(5):
        body.step(0.01, delta_p=200.0, n=4000.0)
    # explicit schemes add forces that cancel pair by pair; implicit stages stop at their tolerance
    after = body.state.velocities @ model.masses
    np.testing.assert_allclose(after, momentum, atol=1e-5 if is_implicit(name) else 1e-12)


@pytest.mark.parametrize(
    ("name", "power"), [("backward-euler", 1 / 2), ("sdirk2", 2 / 3), ("bdf2", 2 / 3)]
)
def test_the_error_falls_with_the_tolerance(name, power):
    """By the power p/(p + 1): a step's error is of order p + 1, and there are more steps."""
    model, start = wobbling(2e4)
    exact = reference(model, start, 0.2)
    errors = []
    for tolerance in (1e-3, 1e-4, 1e-5, 1e-6):
        body = SoftBody(model, INTEGRATORS[name](tolerance=tolerance, max_iterations=50))
        body.state = start
        body.step(0.2, INPUTS.delta_p, INPUTS.n)
        positions = body.state.positions.ravel()
        errors.append(np.abs(positions - exact[: positions.size]).max())
    slope = np.polyfit(np.log([1e-3, 1e-4, 1e-5, 1e-6]), np.log(errors), 1)[0]
    assert power - 0.2 < slope < power + 0.35  # steps are powers of two, so the errors scatter


@pytest.mark.parametrize("resistance", [1e4, 1e5])
def test_rk4_resolves_an_airway_whose_area_grows(resistance):
    """Both substeps and their limit change as the body inflates; velocity Verlet is exact there."""
    volumes = []
    for name in ("rk4", "velocity-verlet"):
        laws = [MassSpring(375.0, 0.1), InternalPressure(2e-3), AirwayResistance(resistance)]
        model = SoftBodyModel(icosphere(1, 0.0842), 1.0, laws)
        body = SoftBody(model, INTEGRATORS[name]())
        volumes.append([body.step(1 / 30, 65.0, 70_000.0).volume for _ in range(10)])
    # Verlet's own error at its stability limit is (hω)²/24 of the oscillations, about 2 %
    np.testing.assert_allclose(volumes[0], volumes[1], rtol=0.02)
