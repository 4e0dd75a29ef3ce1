from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from softbody_core import MeshError, ParameterError, SurfaceMesh, fibonacci_sphere


def test_ball_has_the_counts_of_the_paper():
    mesh = fibonacci_sphere(1986)
    assert (mesh.n_points, len(mesh.triangles), len(mesh.edges)) == (1986, 3968, 5952)


def test_ball_needs_four_points():
    with pytest.raises(ParameterError, match="at least 4"):
        fibonacci_sphere(3)


@settings(max_examples=20, deadline=None)
@given(n=st.integers(4, 200), scale=st.floats(1e-6, 1e3))
def test_sizes_agree_with_trimesh(n, scale):
    mesh = fibonacci_sphere(n, scale)
    other = trimesh.Trimesh(mesh.points, mesh.triangles, process=False)
    assert mesh.volume == pytest.approx(other.volume, rel=1e-10)
    assert mesh.area == pytest.approx(other.area, rel=1e-10)
    # Euler's formula for genus 0, and each side of a triangle is shared by two
    assert mesh.n_points - len(mesh.edges) + len(mesh.triangles) == 2
    assert len(mesh.edges) == 3 * len(mesh.triangles) / 2


def test_operators_agree_with_loops(potato):
    values = np.random.default_rng(0).normal(size=potato.n_points)
    difference = [values[j] - values[i] for i, j in potato.edges]
    np.testing.assert_array_equal(potato.edge_difference @ values, difference)
    for triangle, sides in zip(potato.triangles, potato.triangle_edges, strict=True):
        a, b, c = triangle
        expected = [{a, b}, {b, c}, {c, a}]
        assert [set(potato.edges[e]) for e in sides] == expected
    faces = [set(t) for t in potato.triangles.tolist()]
    for edge, wings in zip(potato.edges.tolist(), potato.edge_wings.tolist(), strict=True):
        assert all({*edge, wing} in faces for wing in wings)
        assert wings[0] != wings[1]


def test_scaling_to_a_volume_keeps_the_shape(potato):
    scaled = potato.scaled_to_volume(2.5e-3)
    assert scaled.volume == pytest.approx(2.5e-3, rel=1e-12)
    ratio = scaled.edge_lengths / potato.edge_lengths
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-12)


def test_points_cannot_be_changed(potato):
    with pytest.raises(ValueError, match="read-only"):
        potato.points[0] = 0


def _sphere():
    mesh = fibonacci_sphere(30)
    return mesh.points.copy(), mesh.triangles.copy()


def _open():
    points, triangles = _sphere()
    return points, triangles[1:]


def _non_manifold():
    """A tetrahedron glued to one triangle from outside."""
    points, triangles = _sphere()
    a, b, c = triangles[0]
    fin = [[a, b, 30], [b, c, 30], [c, a, 30], [c, b, a]]
    return np.vstack([points, [3, 0, 0]]), np.vstack([triangles, fin])


def _flipped_triangle():
    points, triangles = _sphere()
    triangles[5] = triangles[5, ::-1]
    return points, triangles


def _inside_out():
    points, triangles = _sphere()
    return points, triangles[:, ::-1]


def _nan():
    points, triangles = _sphere()
    points[7, 1] = np.nan
    return points, triangles


def _sliver():
    points, triangles = _sphere()
    points[triangles[0, 0]] = 0.5 * (points[triangles[0, 1]] + points[triangles[0, 2]])
    return points, triangles


def _coincident():
    points, triangles = _sphere()
    points[triangles[0, 0]] = points[triangles[0, 1]]
    return points, triangles


def _repeated_corner():
    points, triangles = _sphere()
    triangles[3, 0] = triangles[3, 1]
    return points, triangles


def _pinched():
    """Two tetrahedra that touch in one point."""
    points = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    triangles = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    both = np.vstack([points, -points[1:] + 2 * points[0]])
    second = np.where(triangles == 0, 0, triangles + 3)[:, ::-1]
    return both, np.vstack([triangles, second])


def _unused_point():
    points, triangles = _sphere()
    return np.vstack([points, [9, 9, 9]]), triangles


def _flat():
    points, triangles = _sphere()
    points[:, 2] = 0
    return points, triangles


def _out_of_range():
    points, triangles = _sphere()
    triangles[2, 1] = 99
    return points, triangles


def _two_spheres():
    points, triangles = _sphere()
    return np.vstack([points, 0.1 * points]), np.vstack([triangles, triangles + 30])


def _vast():
    points, triangles = _sphere()
    return 1e10 * points, triangles


BAD = {
    _two_spheres: r"2 separate surfaces; expected one",
    _vast: r"1\.96e\+10 m wide; expected 1e-09 to 1e\+09 m",
    _open: r"3 of 84 edges have only one triangle, so the surface is open: edge \d+ at \(",
    _non_manifold: r"3 of 87 edges have more than two triangles \(non-manifold\): edge \d+ at",
    _flipped_triangle: r"3 of 84 edges have triangles wound in opposite senses: edge \d+ at",
    _inside_out: r"inside out: its enclosed volume is -",
    _nan: r"1 of 30 points have NaN or infinite coordinates: point 7",
    _sliver: r"triangles are degenerate",
    _coincident: r"triangles are degenerate.*weld",
    _repeated_corner: r"1 of 56 triangles are degenerate \(no area\): triangle 3 at",
    _pinched: r"1 of 7 points join separate fans of triangles \(non-manifold\): point 0 at",
    _unused_point: r"1 of 31 points belong to no triangle: point 30 at \(9, 9, 9\).*weld=True",
    _flat: r"flat|degenerate|opposite",
    _out_of_range: r"1 of 56 triangles name points outside 0 … 29: triangle 2",
}


@pytest.mark.parametrize("make", BAD, ids=lambda make: make.__name__)
def test_bad_surfaces_are_refused_with_count_and_place(make):
    with pytest.raises(MeshError, match=BAD[make]):
        SurfaceMesh.from_arrays(*make())


@pytest.mark.parametrize(
    ("points", "triangles", "message"),
    [
        (np.zeros((5, 2)), np.zeros((4, 3), int), r"shape \(5, 2\)"),
        (np.zeros((5, 3)), np.zeros((4, 2), int), r"shape \(4, 2\)"),
        (np.eye(4, 3), np.zeros((4, 3)), "integer point indices"),
        (np.ones((4, 3)), np.zeros((4, 3), int), "all points are at one place"),
    ],
)
def test_wrong_arrays_are_refused(points, triangles, message):
    with pytest.raises(MeshError, match=message):
        SurfaceMesh.from_arrays(points, triangles)


def test_welding_joins_a_triangle_soup():
    mesh = fibonacci_sphere(50)
    soup = mesh.points[mesh.triangles].reshape(-1, 3)
    corners = np.arange(len(soup)).reshape(-1, 3)
    with pytest.raises(MeshError, match="weld=True"):
        SurfaceMesh.from_arrays(soup, corners)
    welded = SurfaceMesh.from_arrays(soup, corners, weld=True)
    assert welded.n_points == 50
    assert welded.volume == pytest.approx(mesh.volume, rel=1e-14)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".off", ".stl"])
def test_files_come_back_as_written(tmp_path, potato, suffix):
    path = tmp_path / f"mesh{suffix}"
    trimesh.Trimesh(potato.points, potato.triangles, process=False).export(path)
    read = SurfaceMesh.from_file(path, weld=suffix == ".stl")
    # STL keeps single precision, OBJ and OFF eight decimals
    assert read.volume == pytest.approx(potato.volume, rel=1e-5)
    assert read.n_points == potato.n_points


def test_a_missing_file_and_a_text_file_are_refused(tmp_path):
    with pytest.raises(MeshError, match="does not exist"):
        SurfaceMesh.from_file(tmp_path / "no.ply")
    path = tmp_path / "poem.ply"
    path.write_text("Tyger Tyger, burning bright")
    with pytest.raises(MeshError, match=r"poem\.ply cannot be read"):
        SurfaceMesh.from_file(path)
    path = tmp_path / "poem.txt"
    path.write_text("In the forests of the night")
    with pytest.raises(MeshError, match=r"poem\.txt"):
        SurfaceMesh.from_file(path)
