from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from softbody_core import (
    Gravity,
    Inputs,
    MassSpring,
    Membrane,
    ParameterError,
    PinnedPoints,
    PinnedTop,
    SurfaceSPH,
    Weights,
    fibonacci_sphere,
)
from softbody_core.forces import FORCES
from softbody_core.ground.parameters import Quantity, quantities_of


@given(alpha=st.floats(max_value=0))
def test_alpha_has_to_be_positive(alpha):
    with pytest.raises(ParameterError, match=r"Weights\.alpha = "):
        Weights(alpha=alpha)


@given(value=st.floats(max_value=0, exclude_max=True), name=st.sampled_from(["beta", "gamma"]))
def test_the_other_weights_cannot_be_negative(value, name):
    with pytest.raises(ParameterError, match=rf"Weights\.{name} = "):
        Weights(**{name: value})


def test_zero_is_allowed_for_the_other_weights():
    assert Weights(1, 0, 0, 0) == Weights(alpha=1, beta=0, gamma=0, delta=0)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    "make",
    [
        lambda bad: MassSpring(bad),
        lambda bad: MassSpring(1.0, bad),
        lambda bad: SurfaceSPH(1.0, core_radius=bad),
        lambda bad: Gravity(bad),
        lambda bad: Inputs(delta_p=bad),
        lambda bad: Inputs(n=bad),
        lambda bad: Weights(delta=bad),
    ],
)
def test_no_parameter_is_nan_or_infinite(make, bad):
    with pytest.raises(ParameterError, match="finite"):
        make(bad)


def test_a_message_names_class_field_value_and_bound():
    with pytest.raises(
        ParameterError, match=r"MassSpring\.stiffness = -5 N/m: expected at least 0"
    ):
        MassSpring(-5.0)
    with pytest.raises(ParameterError, match=r"SurfaceSPH\.core_radius = 0: expected more than 0"):
        SurfaceSPH(1.0, core_radius=0.0)
    with pytest.raises(ParameterError, match=r"Membrane\.poisson_ratio = 1: expected less than 1"):
        Membrane(1.0, 1.0)


@pytest.mark.parametrize("law", FORCES.values(), ids=lambda law: law.__name__)
def test_every_number_of_a_force_has_a_unit(law):
    numbers = {n for n, hint in law.__annotations__.items() if "float" in hint}
    assert numbers == set(quantities_of(law))
    assert all(isinstance(q, Quantity) and q.unit for q in quantities_of(law).values())


def test_pins_hold_points_that_exist():
    mesh = fibonacci_sphere(200)
    held = PinnedTop(0.015).held(mesh)
    assert held.sum() == 3
    assert mesh.points[held, 2].min() >= mesh.points[~held, 2].max()
    assert PinnedPoints((0, 5)).held(mesh).nonzero()[0].tolist() == [0, 5]
    with pytest.raises(ParameterError, match="point 200 does not exist"):
        PinnedPoints((200,)).held(mesh)
    with pytest.raises(ParameterError, match="less than 1"):
        PinnedTop(1.0).held(mesh)
