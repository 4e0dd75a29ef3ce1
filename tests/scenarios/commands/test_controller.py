"""``softbody controller new`` and ``check``: from nothing to a run, and what stands in the way."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import scenarios
from tests.scenarios.conftest import Cli


def test_a_new_controller_works_as_it_is(cli: Cli, tmp_path: Path) -> None:
    said = cli("controller", "new", "my_vent")
    assert said.code == 0
    commands = [part.split() for part in said.out.split("Next:")[1].split("softbody ")[1:]]
    assert [command[0:2] for command in commands] == [
        ["controller", "check"],
        ["run", "sphere-lung"],
        ["controller", "build"],
    ]
    commands[1] += ["--set", "mesh.icosphere=1", "--cycles", "1", "--no-plot"]
    check, run, build = (cli(*command) for command in commands)
    assert (check.code, run.code, build.code) == (0, 0, 0)
    assert "ok: my_vent.py can drive a body" in check.out
    assert (tmp_path / "my_vent.fmu").exists()
    assert "note" not in check.out
    assert "class MyVent(" in (tmp_path / "my_vent.py").read_text()
    assert (tmp_path / "out.nc").exists()


def test_a_new_controller_does_what_its_table_says(cli: Cli) -> None:
    cli("controller", "new", "mine")
    cli("controller", "build", "mine.py", "-o", "mine.fmu")
    small = scenarios.load("sphere-lung", {"mesh.icosphere": 1, "run.cycles": 2})
    tidal = [
        float(scenarios.breaths(scenarios.run(scene, controller="mine.fmu"))["tidal_volume"][-1])
        for scene in (small, small.changed({"controller.mine.tidal_volume": "1 L"}))
    ]
    assert tidal[0] == pytest.approx(0.4, abs=0.1)  # proportional control stays short of 0.5 L
    assert tidal[1] == pytest.approx(2 * tidal[0], rel=0.1)  # the lung stiffens a little


def test_a_new_controller_overwrites_nothing(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("precious")
    said = cli("controller", "new", "mine")
    assert (said.code, said.error_lines) == (2, 1)
    assert "mine.py is there already" in said.error
    assert (tmp_path / "mine.py").read_text() == "precious"


@pytest.mark.parametrize(
    ("name", "fragment"),
    [
        ("My-Vent", "expected small letters, digits and underscores, like 'my_vent'"),
        ("vent.py", "no name for a controller"),
        ("../vent", "no name for a controller"),
        ("", "no name for a controller"),
        ("json", "'json' belongs to Python"),
        ("lambda", "'lambda' belongs to Python"),
        ("paper", "a controller named 'paper' ships already"),
    ],
)
def test_a_name_that_will_not_do_is_refused(
    cli: Cli, tmp_path: Path, name: str, fragment: str
) -> None:
    said = cli("controller", "new", name)
    assert said.code == 2
    assert fragment in said.error
    assert list(tmp_path.iterdir()) == []


def test_check_shows_faults_and_ports(cli: Cli, fmu: Callable[[str], Path]) -> None:
    said = cli("controller", "check", str(fmu("wants_heart_rate")))
    assert said.code == 2
    assert "heart_rate │ input │ 1/min │ nothing" in said.out
    assert "delta_p │ → │ cmH2O │ delta_p │ × 98.0665" in said.out
    assert "fault: has an input 'heart_rate' that the body does not give" in said.out
    assert "cannot drive a body: 1 fault, see above" in said.error
    assert "Traceback" not in said.error


def test_check_takes_the_names_of_a_scenario(
    cli: Cli, fmu: Callable[[str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "cosim.controllers.check.try_fmu", lambda *_: []
    )  # a process takes a second
    text = scenarios.load("sphere-lung").text
    ports = '[controller.ports]\ndelta_p = "Paw"\nvolume = { variable = "V_lung", unit = "mL" }\n'
    (tmp_path / "mine.toml").write_text(f"{text}\n{ports}")
    path = str(fmu("other_names"))
    assert cli("controller", "check", path).code == 2
    said = cli("controller", "check", path, "--scenario", "mine.toml")
    assert (said.code, said.error) == (0, "")
    assert "Paw │ → │ Pa │ delta_p │ × 1" in said.out
    assert "V_lung │ ← │ mL │ volume │ × 1e+06" in said.out


@pytest.mark.parametrize("path", ["none.fmu", "text.fmu", "."])
def test_check_of_what_is_no_fmu_is_bad_input(cli: Cli, tmp_path: Path, path: str) -> None:
    (tmp_path / "text.fmu").write_text("no FMU")
    said = cli("controller", "check", path)
    assert said.code == 2
    assert "cannot drive a body" in said.error
    assert "Traceback" not in said.error
