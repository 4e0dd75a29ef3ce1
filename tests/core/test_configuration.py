from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from softbody_core.configuration import Configuration
from tests.core.forces import deformed

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=20, deadline=None)
@given(seed=seeds)
def test_geometry_agrees_with_trimesh(potato, seed):
    x = deformed(potato, np.random.default_rng(seed))
    here = Configuration(potato, x)
    other = trimesh.Trimesh(x.T, potato.triangles, process=False)
    assert here.volume == pytest.approx(other.volume, rel=1e-11)
    np.testing.assert_allclose(here.bounding_box, other.bounds, rtol=0, atol=0)
    assert here.bounding_box_volume == pytest.approx(np.prod(other.extents), rel=1e-14)
    shares = np.zeros_like(x.T)
    for corner in potato.triangles.T:
        np.add.at(shares, corner, other.face_normals * other.area_faces[:, None] / 3)
    size = np.abs(shares).max()
    np.testing.assert_allclose(here.volume_gradient.T, shares, atol=1e-12 * size)
    lengths = np.linalg.norm(np.diff(x.T[potato.edges], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(here.edge_lengths, lengths, rtol=1e-13)


@pytest.mark.parametrize("name", ["volume", "bounding_box_volume"])
@settings(max_examples=5, deadline=None)
@given(seed=seeds)
def test_gradients_are_derivatives(potato, name, seed):
    x = deformed(potato, np.random.default_rng(seed))
    gradient_name = {"volume": "volume_gradient", "bounding_box_volume": "bounding_box_gradient"}
    gradient = getattr(Configuration(potato, x), gradient_name[name])
    step = 1e-6
    for index in np.ndindex(x.shape):
        up, down = x.copy(), x.copy()
        up[index] += step
        down[index] -= step
        values = [getattr(Configuration(potato, at), name) for at in (up, down)]
        # volumes of 1e-3 m³ to 1e-16: differences over 2e-6 m are good to 1e-12 m²
        slope = (values[0] - values[1]) / (2 * step)
        assert gradient[index] == pytest.approx(slope, abs=1e-10)


@settings(max_examples=20, deadline=None)
@given(seed=seeds)
def test_uniform_pressure_has_no_resultant(potato, seed):
    x = deformed(potato, np.random.default_rng(seed))
    gradient = Configuration(potato, x).volume_gradient
    assert np.abs(gradient.sum(axis=1)).max() < 1e-14 * np.abs(gradient).sum()


def test_volume_survives_being_far_from_the_origin(potato):
    near = Configuration(potato, np.ascontiguousarray(potato.points.T))
    far = Configuration(potato, np.ascontiguousarray(potato.points.T) + 1e6)
    # positions at 1e6 m are rounded to 1e-10 m, 1e-9 of the body's size
    assert far.volume == pytest.approx(near.volume, rel=1e-7)


def test_nothing_is_computed_before_it_is_asked_for(potato):
    here = Configuration(potato, np.ascontiguousarray(potato.points.T))
    assert set(vars(here)) == {"mesh", "positions", "_arrays"}
    assert not here._arrays
    _ = here.volume
    assert "edge_vectors" not in vars(here)


@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_a_moved_configuration_knows_nothing_of_where_it_was(potato, seed):
    generator = np.random.default_rng(seed)
    before, after = deformed(potato, generator), deformed(potato, generator)
    moved, fresh = Configuration(potato, before), Configuration(potato, after)
    names = ["volume", "volume_gradient", "edge_vectors", "edge_lengths", "bounding_box"]
    arrays = [getattr(moved, name) for name in names]
    moved.move_to(after)
    for name, array in zip(names, arrays, strict=True):
        np.testing.assert_array_equal(getattr(moved, name), getattr(fresh, name))
        if name.startswith("edge"):
            assert getattr(moved, name) is array  # nothing was allocated
