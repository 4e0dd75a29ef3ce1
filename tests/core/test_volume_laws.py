"""Laws along ∂V/∂x of one's own: no integrator and no model knows them by name."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from softbody_core import (
    INTEGRATORS,
    AirwayResistance,
    InternalPressure,
    MassSpring,
    SoftBody,
    SoftBodyModel,
    State,
    VelocityVerlet,
    Weights,
    icosphere,
)
from softbody_core.configuration import Configuration
from softbody_core.forces import PressureLaw, ResistanceLaw
from softbody_core.forces.volume_law import Slopes
from softbody_core.state import Inputs
from softbody_core.weights import Control
from tests.core import tangents
from tests.core.forces import INPUTS, bound, deformed, force_at, jacobian

MESH = icosphere(1).scaled_to_volume(2.5e-3)
DRIVE = Inputs(delta_p=900.0, n=500.0)


@dataclass(frozen=True)
class Elastance(PressureLaw):
    """A chest: p = −E (V − V₀)."""

    control = Control.STRUCTURE

    elastance: float
    volume: float = MESH.volume

    def pressure(self, volumes, inputs):
        return -self.elastance * (volumes.volume - self.volume)

    def slopes(self, volumes, inputs):
        return Slopes(volume=-self.elastance)

    def potential(self, volumes, inputs):
        return 0.5 * self.elastance * (volumes.volume - self.volume) ** 2


@dataclass(frozen=True)
class Rohrer(ResistanceLaw):
    """R = K₁ + K₂ |Q|, with twice the K₂ on the way out."""

    k1: float
    k2: float

    def resistance_at(self, flow):
        return self.k1 + self.k2 * abs(flow) * (2 if flow < 0 else 1)

    def differential_resistance_at(self, flow):
        return self.k1 + 2 * self.k2 * abs(flow) * (2 if flow < 0 else 1)


LAWS = [
    MassSpring(375.0, 0.1),
    InternalPressure(1e-3, "enclosed-volume"),
    Elastance(2e5),
    Rohrer(1e5, 1e8),
    AirwayResistance(5e4),
]
MODEL = SoftBodyModel(MESH, 0.05, LAWS)


def reference(end, model=MODEL):
    """Positions and velocities by SciPy."""

    def derivative(_, y):
        x, v = y.reshape(2, 3, -1)
        force = model.total_force(Configuration(MESH, x), v, DRIVE)
        return np.concatenate([v.ravel(), (model.inverse_masses * force).ravel()])

    y0 = np.concatenate([State.at_rest(MESH).positions.ravel(), np.zeros(3 * MESH.n_points)])
    return solve_ivp(derivative, (0, end), y0, method="LSODA", rtol=1e-10, atol=1e-13).y[:, -1]


def test_the_model_adds_up_what_such_laws_give():
    model = SoftBodyModel(MESH, 0.05, LAWS, Weights(alpha=2.0, gamma=3.0))
    here = Configuration(MESH, 1.1 * np.ascontiguousarray(MESH.points.T))
    driving = 3 * (1e-3 * 500 / here.volume + 900)
    recoil = 2 * 2e5 * (here.volume - MESH.volume)
    assert model.pressure(here, DRIVE) == pytest.approx(driving, rel=1e-14)
    assert model.load(here, DRIVE) == pytest.approx(driving - recoil, rel=1e-13)
    assert model.resistance(2e-3) == pytest.approx(1e5 + 2e5 + 5e4, rel=1e-14)
    assert model.resistance(-2e-3) == pytest.approx(1e5 + 4e5 + 5e4, rel=1e-14)
    assert model.differential_resistance(2e-3) == pytest.approx(1e5 + 4e5 + 5e4, rel=1e-14)
    still = np.zeros_like(here.positions)
    springs = model.terms[0][1].force(here, still, DRIVE).copy()
    np.testing.assert_array_equal(model.without_pressures().force(here, still, DRIVE), 2 * springs)


@pytest.mark.parametrize("law", [Elastance(2e5), Rohrer(1e5, 1e8)], ids=repr)
def test_their_tangents_follow_from_what_they_give(law, potato):
    force, masses = bound(law, potato)
    generator = np.random.default_rng(0)
    x = deformed(potato, generator)
    here, v = Configuration(potato, x), 0.1 * generator.normal(size=x.shape)
    still = np.zeros_like(x)
    stiffness = tangents.stiffness(force, here, INPUTS).toarray()
    differences = -jacobian(lambda at: force_at(force, potato, at), x, 1e-6)
    np.testing.assert_allclose(stiffness, differences, atol=2e-5 * max(np.abs(stiffness).max(), 1))
    damping = tangents.damping(force, here, v, INPUTS).toarray()
    differences = -jacobian(lambda at: force_at(force, potato, x, at), v, 1e-6)
    np.testing.assert_allclose(damping, differences, atol=1e-6 * max(np.abs(damping).max(), 1))
    scale = np.tile(masses, 3)[:, None]
    for exact, rate in zip((stiffness, damping), force.rates(here, v, INPUTS), strict=True):
        assert np.linalg.eigvals(exact / scale).real.max() <= rate * (1 + 1e-9)
    assert not force_at(force, potato, x, still).any() or isinstance(law, Elastance)


@pytest.mark.parametrize("name", INTEGRATORS)
def test_every_integrator_takes_them(name):
    volume = Configuration(MESH, reference(0.2)[: 3 * MESH.n_points].reshape(3, -1)).volume
    assert volume > 1.08 * MESH.volume
    body = SoftBody(MODEL, INTEGRATORS[name]())
    for _ in range(20):
        observation = body.step(0.01, DRIVE.delta_p, DRIVE.n)
    # explicit steps at the stability limit, implicit ones at 1e-3; a body of 50 g without inertia
    assert observation.volume == pytest.approx(volume, rel=2e-3)
    flow = observation.flow
    taken = observation.pressure - observation.alveolar_pressure
    assert taken == pytest.approx((1.5e5 + 1e8 * abs(flow)) * flow, rel=1e-12)


def test_a_resistance_that_follows_the_flow_leaves_verlet_its_order():
    heavy = SoftBodyModel(MESH, 1.0, LAWS)  # whose flow settles in 1 ms, and not in 40 µs
    exact, errors, counts = reference(0.02, heavy), [], np.array([128, 256, 512])
    for count in counts:
        body = SoftBody(heavy, VelocityVerlet(max_substep=0.02 / count))
        body.step(0.02, DRIVE.delta_p, DRIVE.n)
        reached = np.concatenate([body.state.positions.ravel(), body.state.velocities.ravel()])
        errors.append(np.abs(reached - exact).max())
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert order == pytest.approx(2, abs=0.15)


def test_quasi_static_flow_solves_the_quadratic_equation():
    """(K₁ + K₂ Q) Q = p: at the first moment, nothing recoils."""
    rohrer = SoftBodyModel(MESH, 1.0, [LAWS[0], InternalPressure(0.0), Rohrer(1e5, 1e9)])
    body = SoftBody(rohrer, INTEGRATORS["quasi-static"]())
    observation = body.step(1e-6, 900.0)
    flow = (-1e5 + np.sqrt(1e10 + 4e9 * 900)) / 2e9
    # dampers resist by a thousandth of R; linear pieces of the path
    assert observation.flow == pytest.approx(flow, rel=1e-2)
