from __future__ import annotations

import numpy as np
import pytest

from softbody_core import (
    FORCES,
    AirwayResistance,
    InternalPressure,
    MassSpring,
    ParameterError,
    PinnedPoints,
    SoftBodyModel,
    Weights,
)
from softbody_core.configuration import Configuration
from softbody_core.forces import ResistanceLaw
from softbody_core.state import Inputs
from softbody_core.weights import Control
from tests.core.forces import EXAMPLES, INPUTS, deformed, force_at


@pytest.fixture
def built(monkeypatch):
    """Names of the laws that are bound."""
    names = []
    for law in FORCES.values():
        original = law.bind

        def bind(self, mesh, masses, original=original, law=law):
            names.append(law.__name__)
            return original(self, mesh, masses)

        monkeypatch.setattr(law, "bind", bind)
    return names


def test_only_the_forces_that_a_scene_names_are_built(potato, built):
    SoftBodyModel(potato, 1.0, [MassSpring(100.0)])
    assert built == ["MassSpring"]


def test_a_force_of_weight_zero_is_not_built(potato, built):
    everything = [laws[0] for laws in EXAMPLES.values()]
    SoftBodyModel(potato, 1.0, everything, Weights(beta=0, gamma=0, delta=0))
    others = [law for law in FORCES.values() if law.control in (None, Control.STRUCTURE)]
    assert sorted(built) == sorted(law.__name__ for law in others)
    assert {AirwayResistance, MassSpring} <= set(others)
    assert len(others) < len(FORCES)


def test_no_airway_is_built_for_zero_resistance(potato, built):
    model = SoftBodyModel(potato, 1.0, [MassSpring(1.0), AirwayResistance(0.0)])
    assert built == ["MassSpring"]
    assert model.resistances == []


def test_the_composite_force_is_the_weighted_sum(potato):
    x = deformed(potato, np.random.default_rng(0))
    v = np.random.default_rng(1).normal(size=x.shape)
    laws = [laws[0] for laws in EXAMPLES.values() if not isinstance(laws[0], ResistanceLaw)]
    weights = {
        Control.STRUCTURE: 0.5,
        Control.ANAMORPHOSIS: 2.0,
        Control.VOLUME: 3.0,
        Control.GRAVITY: 0.1,
        None: 1.0,
    }
    model = SoftBodyModel(potato, 0.7, laws, Weights(0.5, 2.0, 3.0, 0.1))
    expected = sum(
        weights[law.control] * force_at(law.bind(potato, model.masses), potato, x, v)
        for law in laws
    )
    actual = model.force(Configuration(potato, x), v, INPUTS)
    np.testing.assert_allclose(actual, expected, rtol=1e-12, atol=1e-12)


def test_mass_is_shared_by_area(potato):
    model = SoftBodyModel(potato, 0.7, [MassSpring(1.0)])
    assert model.masses.sum() == pytest.approx(0.7, rel=1e-14)
    np.testing.assert_allclose(model.masses / potato.point_areas, 0.7 / potato.area, rtol=1e-13)


def test_held_points_feel_no_acceleration(potato):
    pins = [PinnedPoints((3, 7)), PinnedPoints((7, 9))]
    model = SoftBodyModel(potato, 1.0, [MassSpring(10.0)], constraints=pins)
    x = deformed(potato, np.random.default_rng(0))
    acceleration = model.acceleration(Configuration(potato, x), np.zeros_like(x), Inputs())
    still = np.flatnonzero(~acceleration.any(axis=0))
    assert still.tolist() == [3, 7, 9]


def test_the_wall_feels_gamma_times_gas_and_drive(potato):
    model = SoftBodyModel(potato, 1.0, [InternalPressure(1e-3)], Weights(gamma=2.5))
    here = Configuration(potato, np.ascontiguousarray(potato.points.T))
    box = np.prod(np.ptp(potato.points, axis=0))
    expected = 2.5 * (1e-3 * 40_000 / box + 350)
    assert model.pressure(here, INPUTS) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("mass", [0.0, -1.0, np.nan, np.inf])
def test_mass_has_to_be_positive(potato, mass):
    with pytest.raises(ParameterError, match="mass = "):
        SoftBodyModel(potato, mass, [MassSpring(1.0)])


def test_a_law_cannot_be_given_twice(potato):
    with pytest.raises(ParameterError, match="MassSpring is given twice"):
        SoftBodyModel(potato, 1.0, [MassSpring(1.0), MassSpring(2.0)])
