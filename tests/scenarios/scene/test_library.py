"""Every scenario that ships runs, and shows one physical number of its own."""

from __future__ import annotations

import pytest

import scenarios
from scenarios import breaths
from scenarios.running.assemble import build_body
from tests.scenarios.scene.claims import CLAIMS, check_claim, short_run


def test_every_claim_is_that_of_a_scenario() -> None:
    assert set(CLAIMS) <= set(scenarios.names())


@pytest.mark.parametrize("name", scenarios.names())
def test_a_short_run_holds_its_claim(name: str) -> None:
    check_claim(name, short_run(name))


@pytest.mark.slow
@pytest.mark.parametrize("name", scenarios.names())
def test_the_run_as_it_ships_holds_its_claim(name: str) -> None:
    scenario = scenarios.load(name)
    falls = bool(scenario.obstacles)
    dataset = scenarios.run(scenario, positions_every=0.01 if falls else None)
    assert falls or breaths(dataset).sizes["breath"] == scenario.run.cycles
    check_claim(name, dataset)


def test_a_stiffer_lung_keeps_less() -> None:
    soft, middling, stiff = (
        float(breaths(short_run(name))["residual_volume"][0])
        for name in ("lung-a", "lung-b", "lung-c")
    )
    assert soft > middling > stiff


def test_the_lung_hangs_from_its_top() -> None:
    body = build_body(scenarios.load("lung"))
    held = body.model.inverse_masses == 0
    heights = body.positions[:, 2]
    assert 0.01 < held.mean() < 0.02  # 1.5 % of the points, rounded
    assert heights[held].min() >= heights[~held].max()


@pytest.mark.parametrize("name", scenarios.names())
def test_a_scenario_names_what_it_is(name: str) -> None:
    assert scenarios.load(name).title != name
