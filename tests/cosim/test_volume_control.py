"""Volume control against the closed forms of a lung of one resistance and one compliance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cosim import FmuError
from tests.cosim.helpers import Lung, breathe

FRAME = 1 / 30
BREATH = 120  # frames
RESISTANCE, COMPLIANCE = 10.0, 0.05
TIDAL, RAMP, PAUSE = 0.5, 1.2, 0.8
SETTINGS = {
    "tidal_volume": f"{TIDAL} L",
    "inspiratory_time": f"{RAMP + PAUSE} s",
    "pause": f"{PAUSE} s",
    "peep": "5 cmH2O",
    "resistance": f"{RESISTANCE} cmH2O.s/L",
}

Points = list[Mapping[str, Mapping[str, float]]]


@pytest.fixture(scope="module")
def fmu(shipped: Mapping[str, Path]) -> Path:
    return shipped["volume-control"]


@pytest.fixture(scope="module")
def breathing(fmu: Path) -> Points:
    """Ten breaths; the first ones, which fill up to PEEP, have died away to exp(-40)."""
    return breathe(fmu, Lung(RESISTANCE, COMPLIANCE), FRAME, 10 * BREATH, **SETTINGS)


def volumes(points: Points) -> list[float]:
    return [point["lung"]["volume"] for point in points]


def test_tidal_volume_is_the_one_asked_for(breathing: Points) -> None:
    volume = volumes(breathing)[9 * BREATH :]
    pause_ends = round((RAMP + PAUSE) / FRAME)
    # What is missing shrinks in the pause at least as 0.75^k over 24 frames: 1e-3 of some mL.
    assert volume[pause_ends] - volume[0] == pytest.approx(TIDAL, rel=1e-5)
    assert max(volume) - volume[0] == pytest.approx(TIDAL, rel=2e-3)


def test_flow_is_constant_and_the_lag_that_of_the_closed_form(breathing: Points) -> None:
    rate = TIDAL / RAMP
    # In the steady ramp p rises by Q h / C a frame, and so R (V* - V)/(2h) is that.
    lag = 2 * rate * FRAME**2 / (COMPLIANCE * RESISTANCE)
    for i in range(9 * BREATH + 24, 9 * BREATH + 36):  # after 24 frames of settling, as above
        point, before = breathing[i], breathing[i - 1]
        flow = (point["lung"]["volume"] - before["lung"]["volume"]) / FRAME
        assert flow == pytest.approx(rate, rel=1e-5)
        behind = point["controller"]["target_volume"] - point["lung"]["volume"]
        assert behind == pytest.approx(lag, rel=1e-3)


def test_peak_and_plateau_pressures_are_those_of_the_equation_of_motion(breathing: Points) -> None:
    start = 9 * BREATH
    ramp_ends, pause_ends = round(RAMP / FRAME), round((RAMP + PAUSE) / FRAME)
    peak = breathing[start + ramp_ends]["controller"]["respiratory_pressure"]
    plateau = breathing[start + pause_ends]["controller"]["respiratory_pressure"]
    volume = volumes(breathing)
    assert plateau == pytest.approx(volume[start + pause_ends] / COMPLIANCE, rel=1e-4)
    # Held over a frame, the pressure that moves the lung by Q h is R Q and the recoil half-way.
    decay = math.exp(-FRAME / (RESISTANCE * COMPLIANCE))
    moved = TIDAL / RAMP * FRAME / (1 - decay)
    assert peak == pytest.approx((volume[start + ramp_ends - 1] + moved) / COMPLIANCE, rel=1e-5)
    # As at the bedside, resistance from the two: less by the recoil of the lag and of half a frame.
    late = 2 * FRAME**2 / (COMPLIANCE * RESISTANCE) + FRAME / 2
    expected = RESISTANCE - late / COMPLIANCE
    assert (peak - plateau) / (TIDAL / RAMP) == pytest.approx(expected, rel=1e-3)  # second order


def test_exhalation_is_passive(breathing: Points) -> None:
    start = 9 * BREATH + round((RAMP + PAUSE) / FRAME)
    rest = 5.0 * COMPLIANCE
    full = volumes(breathing)[start] - rest
    for i in range(1, 60):
        decay = math.exp(-i * FRAME / (RESISTANCE * COMPLIANCE))
        assert breathing[start + i]["controller"]["delta_p"] == 5.0
        # Sixty exact steps of the lung: their roundings.
        assert volumes(breathing)[start + i] - rest == pytest.approx(full * decay, abs=1e-14)


def test_pressure_stays_below_its_limit_and_does_not_wind_up(fmu: Path) -> None:
    limited = {**SETTINGS, "pressure_limit": "12 cmH2O"}
    points = breathe(fmu, Lung(RESISTANCE, COMPLIANCE), FRAME, 3 * BREATH, **limited)
    assert max(point["controller"]["delta_p"] for point in points) == 12.0
    # It reaches C 12 cmH2O at most, and goes down at once when exhalation begins.
    assert 0.5 < max(volumes(points)) < COMPLIANCE * 12.0
    assert points[2 * BREATH + 61]["controller"]["delta_p"] == 5.0


@settings(max_examples=15, deadline=None)
@given(
    resistance=st.floats(2.0, 50.0),
    compliance=st.floats(0.02, 0.1),
    assumed=st.floats(0.4, 1.5),
)
def test_tidal_volume_is_reached_while_the_resistance_is_misjudged(
    fmu: Path, resistance: float, compliance: float, assumed: float
) -> None:
    guess = {
        **SETTINGS,
        "resistance": f"{assumed * resistance!r} cmH2O.s/L",
        "pressure_limit": "1000 cmH2O",
    }
    points = breathe(fmu, Lung(resistance, compliance), FRAME, 60, **guess)
    # The roots are below 0.85 in size from 0.4 to 1.5 R: 0.85^24 of the ramp's lag, a few per cent.
    assert points[60]["lung"]["volume"] == pytest.approx(TIDAL, rel=0.01)


def test_resistance_above_the_stated_limit_makes_it_swing(fmu: Path) -> None:
    def swing(assumed: float) -> float:
        """Change of pressure from frame to frame late in the ramp, cmH2O."""
        guess = {**SETTINGS, "resistance": f"{assumed * RESISTANCE} cmH2O.s/L"}
        lung = Lung(RESISTANCE, 10.0)  # so soft that recoil does not damp
        pressures = [p["controller"]["delta_p"] for p in breathe(fmu, lung, FRAME, 36, **guess)]
        return max(abs(b - a) for a, b in pairwise(pressures[26:]))

    # The roots are −0.84 and −1.23; the pressure of the flow itself is 4 cmH2O.
    assert swing(1.5) < 0.3
    assert swing(1.75) > 3.0


@pytest.mark.parametrize(
    "times", [{"pause": "2 s"}, {"inspiratory_time": "4 s"}], ids=["no flow", "no expiration"]
)
def test_times_that_do_not_fit_a_breath_are_refused(fmu: Path, times: dict[str, Any]) -> None:
    with pytest.raises(FmuError, match=r"inspiratory_time = \d\.0 s: expected more than the pause"):
        breathe(fmu, Lung(10.0, 0.05), FRAME, 1, **{**SETTINGS, **times})
