from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from softbody_core import MeshError, ParameterError, revolved, wine_glass
from softbody_core.shapes import _WINE_GLASS


def pappus(profile, segments):
    """Volume of a polygon turned about the axis in N flat parts, m³.

    Pappus: 2π times the first moment of area, ∬ r dr dz = Σ (z₂ − z₁)(r₁² + r₁r₂ + r₂²)/6; of each
    circle of radius r the N-gon keeps the part N/(2π) sin(2π/N).
    """
    r, z = np.array(profile).T
    r1, r2 = r[:-1], r[1:]
    moment = np.sum(np.diff(z) * (r1**2 + r1 * r2 + r2**2)) / 6
    return segments * np.sin(2 * np.pi / segments) * moment


radii = st.lists(st.floats(0.1, 3.0), min_size=1, max_size=8)


@given(radii=radii, segments=st.integers(3, 60), height=st.floats(0.1, 5.0))
@settings(deadline=None, max_examples=40)
def test_what_is_turned_is_closed_and_has_the_volume_of_pappus(radii, segments, height):
    levels = np.linspace(0, height, len(radii))
    profile = [(0.0, -0.1), *zip(radii, levels.tolist(), strict=True), (0.0, height + 0.1)]
    mesh = revolved(profile, segments)  # which refuses what is open or wound inward
    assert mesh.volume == pytest.approx(pappus(profile, segments), rel=1e-12)
    assert mesh.n_points == 2 + segments * len(radii)
    assert trimesh.Trimesh(mesh.points, mesh.triangles, process=False).is_watertight


@pytest.mark.parametrize("segments", [3, 48, 96])
def test_the_glass_has_the_volume_of_pappus(segments):
    glass = wine_glass(segments)
    assert glass.volume == pytest.approx(pappus(_WINE_GLASS, segments), rel=1e-12)
    assert np.ptp(glass.points[:, 2]) == pytest.approx(0.205, rel=1e-14)


def test_the_bowl_holds_406_millilitres():
    """Under the rim, inside the inner wall: discs of the inner profile, by quadrature."""
    r, z = np.array(_WINE_GLASS).T
    rim = int(np.flatnonzero(z == z.max())[-1])
    inner_r, inner_z = r[rim:][::-1], z[rim:][::-1]
    heights = np.linspace(inner_z[0], inner_z[-1], 200_001)
    discs = np.pi * np.interp(heights, inner_z, inner_r) ** 2
    assert np.trapezoid(discs, heights) == pytest.approx(406e-6, abs=0.5e-6)


def test_the_walls_of_the_glass_are_thin():
    """1 to 2 mm along the bowl, between the two walls at one height."""
    r, z = np.array(_WINE_GLASS).T
    rim = int(np.flatnonzero(z == z.max())[0])
    heights = np.linspace(0.12, 0.20, 50)
    outer = np.interp(heights, z[: rim + 1], r[: rim + 1])
    inner = np.interp(heights, z[rim + 1 :][::-1], r[rim + 1 :][::-1])
    assert ((outer - inner > 1e-3) & (outer - inner < 2.1e-3)).all()


@pytest.mark.parametrize(
    ("profile", "segments", "said"),
    [
        ([(0, 0), (1, 0), (0, 1)], 2, "2 segments of a surface of revolution: expected at least 3"),
        ([(0.1, 0), (1, 0), (0, 1)], 8, "starts and ends at r = 0"),
        ([(0, 0), (1, 0), (0.1, 1)], 8, "starts and ends at r = 0"),
        ([(0, 0), (0, 0.5), (0, 1)], 8, "only points with r > 0 in between"),
        ([(0, 0), (-1, 0.5), (0, 1)], 8, "only points with r > 0 in between"),
        ([(0, 0), (0, 1)], 8, "starts and ends"),
    ],
)
def test_a_profile_that_makes_no_sense_is_named(profile, segments, said):
    with pytest.raises(ParameterError, match=said):
        revolved(profile, segments)


def test_a_profile_the_wrong_way_round_is_refused():
    with pytest.raises(MeshError):
        revolved([(0, 1), (1, 0.5), (0, 0)], 8)
