"""What a run is not asked for costs nothing: counted in calls and in what is kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import scenarios
from cosim import Variable
from scenarios import Scenario, trade
from scenarios.commands import run as run_command
from scenarios.running import assemble, session
from scenarios.running.snapshots import Snapshots
from scenarios.running.variables import variables_of
from scenarios.scene import scenario as scenario_module
from scenarios.scene.scenario import Draft
from softbody_core import SoftBody, SurfaceSPH
from softbody_core.forces import surface_sph
from tests.scenarios.conftest import SMALL, Cli


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Times at which the positions of a body are copied."""
    times: list[float] = []

    def positions(body: SoftBody) -> np.ndarray:
        times.append(body.time)
        return body.state.positions.T.copy()

    monkeypatch.setattr(SoftBody, "positions", property(positions))
    return times


def test_positions_are_kept_on_request_alone(
    small: Scenario, looks: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Snapshots] = []

    def make(*arguments: object) -> Snapshots:
        made.append(Snapshots(*arguments))
        return made[-1]

    monkeypatch.setattr(session, "Snapshots", make)
    dataset = scenarios.run(small)
    assert (looks, made[0]._positions, made[0]._times) == ([], [], [])
    assert {"position", "triangles"}.isdisjoint(dataset.data_vars)
    assert set(dataset.sizes) == {"time", "axis"}
    asked = scenarios.run(small, positions_every=0.5)
    np.testing.assert_allclose(looks, np.arange(9) * 0.5, atol=1e-12)
    assert asked["position"].shape == (9, 162, 3)


def test_a_dataset_holds_what_is_recorded_and_nothing_else(
    small: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = ["flow", "volume"]

    def few(*participants: Any) -> list[Variable]:
        return [variable for variable in variables_of(*participants) if variable.name in wanted]

    assert len(scenarios.run(small).data_vars) > len(wanted)
    monkeypatch.setattr(session, "variables_of", few)
    assert sorted(scenarios.run(small).data_vars) == wanted


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the scenarios that are built."""
    built: list[str] = []
    original = Draft.build

    def build(draft: Draft, **options: bool) -> Scenario:
        built.append(draft.name)
        return original(draft, **options)

    monkeypatch.setattr(Draft, "build", build)
    return built


def test_a_command_builds_its_scenario_once(cli: Cli, builds: list[str]) -> None:
    changes = ("--set", "mesh.icosphere=1", "--cycles", "1", "--controller", "pressure-control")
    assert cli("run", "sphere-lung", *changes, "--no-plot").code == 0
    assert builds == ["sphere-lung"]


def test_a_trade_builds_each_cell_once(small: Scenario, builds: list[str]) -> None:
    short = small.changed({"mesh.icosphere": 1, "run.period": 1.0})
    builds.clear()
    trade(short, {"integrator": ("rk4", "sdirk2"), "dt": (1.0, 0.5)})
    assert len(builds) == 1 + 4 + 2  # with its number of cycles, the cells, and two references


def test_text_is_made_when_it_is_asked_for(
    small: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []
    monkeypatch.setattr(scenario_module, "toml", lambda *_: made.append("text") or "title = ''")
    changed = small.changed({"forces.alpha": 2.0}).changed({"mesh.icosphere": 1})
    assert made == []
    assert scenarios.run(changed).attrs["scenario"] == "title = ''"
    assert made == ["text"]


def test_a_body_is_looked_at_once_a_communication_step(
    small: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[float] = []
    original = SoftBody.observe

    def observe(body: SoftBody) -> object:
        seen.append(body.time)
        return original(body)

    monkeypatch.setattr(SoftBody, "observe", observe)
    scenarios.run(small)
    assert len(seen) == 1 + 120
    assert len(set(seen)) == 1 + 120


def test_a_scenario_without_a_fluid_binds_none(
    small: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    searches: list[float] = []

    class Watched(surface_sph.NeighbourList):
        def __init__(self, radius: float) -> None:
            searches.append(radius)
            super().__init__(radius)

    monkeypatch.setattr(surface_sph, "NeighbourList", Watched)
    fluid = {"forces.surface_sph.gas_constant": "30 m^2/s^2"}
    assert SurfaceSPH not in {type(law) for law in small.forces}
    scenarios.running.assemble.build_body(small)
    scenarios.running.assemble.build_body(small.changed({**fluid, "forces.beta": 0.0}))
    assert searches == []
    scenarios.running.assemble.build_body(small.changed(fluid))
    assert len(searches) == 1


def test_a_command_makes_what_it_is_asked_for(
    cli: Cli, looks: list[float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No trials without --accuracy, no picture with --no-plot, one body, no positions."""
    bodies: list[Scenario] = []
    original = assemble.build_body

    def build_body(scenario: Scenario) -> SoftBody:
        bodies.append(scenario)
        return original(scenario)

    def unasked(*_: object, **__: object) -> None:
        pytest.fail("nobody asked for this")

    monkeypatch.setattr(assemble, "build_body", build_body)
    monkeypatch.setattr(run_command, "pick", unasked)
    monkeypatch.setattr(run_command, "save_overview", unasked)
    changes = [part for path, value in SMALL.items() for part in ("--set", f"{path}={value}")]
    said = cli("run", "sphere-lung", *changes, "--no-plot", "--quiet")
    assert (said.code, said.out) == (0, "")
    assert (len(bodies), looks) == (1, [])
    assert [path.name for path in tmp_path.iterdir() if not path.is_dir()] == ["out.nc"]
    with xr.open_dataset(tmp_path / "out.nc") as dataset:
        assert "position" not in dataset
        assert dataset.sizes["time"] == 121
