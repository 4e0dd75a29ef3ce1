from __future__ import annotations

import pytest

import scenarios
from scenarios.running.assemble import build_mesh
from scenarios.scene.schema import Mesh
from softbody_core import icosphere


@pytest.fixture
def in_millimetres(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    surface = icosphere(1, 80.0)
    trimesh.Trimesh(surface.points, surface.triangles, process=False).export(tmp_path / "mm.ply")
    return tmp_path


def test_a_file_in_millimetres_is_not_taken_for_metres(in_millimetres):
    with pytest.raises(scenarios.ScenarioError, match=r'm³ if its .* mesh\.unit = "mm"'):
        build_mesh(Mesh(file="mm.ply"), in_millimetres)


@pytest.mark.parametrize(("unit", "radius"), [("mm", 0.08), ("m", 80.0), ("cm", 0.8)])
def test_a_file_is_read_in_its_unit(in_millimetres, unit, radius):
    mesh = build_mesh(Mesh(file="mm.ply", unit=unit), in_millimetres)
    # PLY keeps single precision
    assert mesh.volume == pytest.approx(icosphere(1, radius).volume, rel=1e-6)


def test_a_file_can_be_scaled_to_a_volume(in_millimetres):
    mesh = build_mesh(Mesh(file="mm.ply", volume=2.5e-3), in_millimetres)
    assert mesh.volume == pytest.approx(2.5e-3, rel=1e-12)


def test_an_unknown_unit_is_named(in_millimetres):
    with pytest.raises(
        scenarios.ScenarioError, match="mesh: '1 furlongs3' cannot be converted to 'm'"
    ):
        build_mesh(Mesh(file="mm.ply", unit="furlongs3"), in_millimetres)
