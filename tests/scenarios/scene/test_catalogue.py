from __future__ import annotations

from pathlib import Path

import pytest

import scenarios
from scenarios import ScenarioError


def test_the_scenarios_of_the_paper_and_their_checks_ship() -> None:
    promised = {"lung", "lung-a", "lung-b", "lung-c", "sphere-lung", "lung-pressure-control"}
    assert promised <= set(scenarios.names())
    assert scenarios.names() == sorted(scenarios.names())


def test_lung_is_table_2_c() -> None:
    lung, table_2_c = scenarios.load("lung"), scenarios.load("lung-c")
    assert lung.weights == table_2_c.weights
    assert (lung.mesh, lung.body, lung.forces) == (
        table_2_c.mesh,
        table_2_c.body,
        table_2_c.forces,
    )


def test_an_unknown_name_gets_the_nearest_one() -> None:
    with pytest.raises(ScenarioError, match=r"'sphere-lnug'.*did you mean 'sphere-lung'"):
        scenarios.load("sphere-lnug")


def test_a_file_loads_as_the_same_scenario(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(scenarios.load("sphere-lung").text)
    shipped = scenarios.load("sphere-lung")
    for given in (path, str(path)):
        mine = scenarios.load(given)
        assert mine.name == "mine"
        assert mine.folder == tmp_path.resolve()
        assert (mine.forces, mine.weights, mine.run) == (
            shipped.forces,
            shipped.weights,
            shipped.run,
        )


def test_a_mesh_file_is_sought_beside_the_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    (home / "tetrahedron.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    text = scenarios.load("sphere-lung", {"run.cycles": 1, "mesh.icosphere": 2}).text
    (home / "mine.toml").write_text(text.replace("icosphere = 2", 'file = "tetrahedron.obj"'))
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    dataset = scenarios.run(scenarios.load("../home/mine.toml", {"controller.paper.law": "open"}))
    # Scaled by the cube root of the volume ratio: a few roundings.
    assert float(dataset["volume"][0]) == pytest.approx(2.5, rel=1e-14)


def test_a_missing_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"none.toml cannot be read"):
        scenarios.load(tmp_path / "none.toml")


def test_a_folder_is_no_scenario(tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(ScenarioError, match=r"folder.toml cannot be read"):
        scenarios.load(tmp_path / "folder.toml")


def test_a_file_that_is_no_text_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ScenarioError, match=r"binary.toml cannot be read"):
        scenarios.load(tmp_path / "binary.toml")
