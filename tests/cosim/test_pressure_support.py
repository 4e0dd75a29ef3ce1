"""Pressure support against the closed form of flow in a lung of one compartment."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from cosim import FmuError
from tests.cosim.helpers import Lung, breathe

FRAME = 0.01
RESISTANCE, COMPLIANCE = 10.0, 0.05
TAU = RESISTANCE * COMPLIANCE
PASSIVE = {"peep": "0 cmH2O", "rise_time": "0 s", "effort": "0 cmH2O", "frame": "0.01 s"}


@pytest.fixture(scope="module")
def fmu(shipped: Mapping[str, Path]) -> Path:
    return shipped["pressure-support"]


def phases(points: list[Mapping[str, Mapping[str, float]]]) -> list[float]:
    """Phase of each frame."""
    return [point["controller"]["phase"] for point in points[1:]]


@pytest.mark.parametrize("share", [0.1, 0.25, 0.5, 0.7])
@pytest.mark.parametrize("resistance", [5.0, 20.0])
def test_breath_lasts_until_flow_has_decayed(fmu: Path, share: float, resistance: float) -> None:
    support, tau = 12.0, resistance * COMPLIANCE
    parameters = {**PASSIVE, "cycle_off": share, "support": f"{support} cmH2O"}
    lung = Lung(resistance, COMPLIANCE)
    points = breathe(fmu, lung, FRAME, 400, longest_inspiration="10 s", **parameters)
    # The first flow that is seen is that after one frame, and the breath ends with the first
    # frame that sees less than the share of it: τ ln(1/share) later, rounded up.
    frames = 1 + math.ceil(tau * math.log(1 / share) / FRAME)
    assert phases(points) == [1.0] * frames + [0.0] * (400 - frames)
    filled = COMPLIANCE * support * (1 - math.exp(-frames * FRAME / tau))
    # The lung is solved exactly: some hundred roundings.
    assert points[frames]["lung"]["volume"] == pytest.approx(filled, rel=1e-12)


def test_breath_is_triggered_when_the_effort_draws_enough_flow(fmu: Path) -> None:
    effort, length, trigger = 8.0, 1.2, 6.0
    parameters = {
        "effort": f"{effort} cmH2O",
        "effort_time": f"{length} s",
        "trigger_flow": f"{trigger} L/min",
        "rate": "6 1/min",
        "peep": "5 cmH2O",
        "frame": "0.001 s",
    }
    points = breathe(fmu, Lung(RESISTANCE, COMPLIANCE), 0.001, 11_000, **parameters)
    outputs = phases(points)[10_000:]  # the second effort, on a lung at rest at PEEP: exp(-15)

    def flow(time: float) -> float:
        """Flow that a half sine draws into a lung at rest, L/min."""
        omega = math.pi / length
        answer = math.cos(omega * time) + omega * TAU * math.sin(omega * time)
        size = COMPLIANCE * effort * omega / (1 + (omega * TAU) ** 2)
        return 60 * size * (answer - math.exp(-time / TAU))

    triggered = outputs.index(1.0) * 0.001
    # The effort is held over each millisecond, which delays it by half of one.
    assert flow(triggered - 0.003) < trigger < flow(triggered + 0.001)


@pytest.mark.parametrize(("effort", "breaths"), [(0.0, 1), (0.3, 1), (5.0, 3)])
def test_each_strong_effort_makes_one_breath(fmu: Path, effort: float, breaths: int) -> None:
    parameters = {"effort": f"{effort} cmH2O", "frame": "0.01 s"}
    outputs = phases(breathe(fmu, Lung(RESISTANCE, COMPLIANCE), FRAME, 1200, **parameters))
    starts = [
        i for i in range(len(outputs)) if outputs[i] == 1.0 and (i == 0 or outputs[i - 1] == 0.0)
    ]
    assert len(starts) == breaths


def test_airway_pressure_rises_evenly_and_the_wall_feels_both(fmu: Path) -> None:
    parameters = {"rise_time": "0.1 s", "support": "10 cmH2O", "peep": "5 cmH2O"}
    points = breathe(fmu, Lung(RESISTANCE, COMPLIANCE), FRAME, 30, frame="0.01 s", **parameters)
    for i, point in enumerate(points[1:31], start=1):
        airway = 5.0 + 10.0 * min(i / 10, 1.0)
        muscles = 5.0 * math.sin(math.pi * (i - 1) * FRAME)
        given = point["controller"]
        # The slack of a frame, 1e-8 s, on slopes of 100 and 16 cmH2O/s.
        assert given["respiratory_pressure"] == pytest.approx(airway, abs=2e-6)
        assert given["muscle_pressure"] == pytest.approx(muscles, abs=1e-6)
        assert given["delta_p"] == given["respiratory_pressure"] + given["muscle_pressure"]


def test_breath_that_flow_does_not_end_is_ended_by_time(fmu: Path) -> None:
    points = breathe(fmu, Lung(RESISTANCE, COMPLIANCE), FRAME, 400, cycle_off=0.0, **PASSIVE)
    assert phases(points) == [1.0] * 300 + [0.0] * 100


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"effort_time": "4 s"}, r"effort_time = 4\.0 s: expected less than the breath's 4 s"),
        ({"cycle_off": 1.5}, "cycle_off = 1.5: expected at most 1"),
    ],
)
def test_what_does_not_fit_is_refused(fmu: Path, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(FmuError, match=message):
        breathe(fmu, Lung(10.0, 0.05), FRAME, 1, **parameters)
