"""The two limbs of the hysteresis controller, and the loop that they close upon."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from cosim import FmuError
from tests.cosim.helpers import Lung, breathe

FRAME, FRAMES = 1 / 30, 120
LOW, HIGH = 4.0, 26.0
A, B, C_INFLATION, C_DEFLATION, D = 0.3, 2.0, 20.0, 10.0, 5.0
SETTINGS = {
    "asymptote": f"{A} L",
    "vital_capacity": f"{B} L",
    "pressure_low": f"{LOW} cmH2O",
    "pressure_high": f"{HIGH} cmH2O",
}
Points = list[Mapping[str, Mapping[str, float]]]


@pytest.fixture(scope="module")
def fmu(shipped: Mapping[str, Path]) -> Path:
    return shipped["hysteresis"]


@pytest.fixture(scope="module")
def breathing(fmu: Path) -> Points:
    lung = Lung(5.0, 0.1)
    lung.volume = 1.0
    return breathe(fmu, lung, FRAME, 12 * FRAMES, **SETTINGS)


def sigmoid(pressure: float, centre: float) -> float:
    return 1 / (1 + math.exp(-(pressure - centre) / D))


def inflation(pressure: float, start: float) -> float:
    """From (LOW, start) up."""
    left = (1 - sigmoid(pressure, C_INFLATION)) / (1 - sigmoid(LOW, C_INFLATION))
    return A + B - (A + B - start) * left


def deflation(pressure: float, start: float) -> float:
    """From (HIGH, start) down."""
    return A + (start - A) * sigmoid(pressure, C_DEFLATION) / sigmoid(HIGH, C_DEFLATION)


def test_limbs_start_where_the_last_one_ended(breathing: Points) -> None:
    volume = 1.0  # the lung's own, where the first limb starts
    for breath in range(12):
        for limb, ends in ((inflation, (LOW, HIGH)), (deflation, (HIGH, LOW))):
            first = breath * FRAMES + (0 if limb is inflation else FRAMES // 2)
            for i in range(1, FRAMES // 2 + 1):
                pressure = ends[0] + (ends[1] - ends[0]) * i / (FRAMES // 2)
                given_ = breathing[first + i]["controller"]
                # Some roundings of numbers below 30, and exponentials of them.
                assert given_["respiratory_pressure"] == pytest.approx(pressure, rel=1e-13)
                assert given_["target_volume"] == pytest.approx(limb(pressure, volume), rel=1e-12)
                assert given_["phase"] == float(limb is inflation)
            volume = limb(ends[1], volume)


def test_loops_close_upon_the_one_of_the_closed_form(breathing: Points) -> None:
    up = (1 - sigmoid(HIGH, C_INFLATION)) / (1 - sigmoid(LOW, C_INFLATION))
    down = sigmoid(LOW, C_DEFLATION) / sigmoid(HIGH, C_DEFLATION)
    # top = A + B − (A + B − bottom) up and bottom = A + (top − A) down, solved.
    bottom = A + B * down * (1 - up) / (1 - up * down)
    lows = [breathing[k * FRAMES]["controller"]["target_volume"] for k in range(1, 13)]
    assert lows[-1] == pytest.approx(bottom, rel=1e-12)  # (up down)^12 = 5e-15 is left
    off = np.array([1.0, *lows[:4]]) - bottom
    np.testing.assert_allclose(off[1:] / off[:-1], up * down, rtol=1e-6)


def test_loop_holds_the_area_between_its_limbs(breathing: Points) -> None:
    last = [point["controller"] for point in breathing[11 * FRAMES :]]
    pressure = np.array([LOW, *(point["respiratory_pressure"] for point in last[1:])])
    volume = np.array([point["target_volume"] for point in last])
    area = -np.trapezoid(pressure, volume)
    bottom, top = volume[0], volume[FRAMES // 2]
    between = quad(lambda p: deflation(p, top) - inflation(p, bottom), LOW, HIGH)[0]
    # Deflation lies above inflation, so work is lost; 60 trapezia a limb are good to 1e-3.
    assert area < 0 < between
    assert -area == pytest.approx(between, rel=2e-3)


def test_lung_follows_the_limbs(breathing: Points) -> None:
    wanted = np.array([point["controller"]["target_volume"] for point in breathing[FRAMES:]])
    volume = np.array([point["lung"]["volume"] for point in breathing[FRAMES:]])
    # As in volume control it lags by 2h²/(C R̂) of the slope, which is below 1.2 L/s here, and the
    # slope's changes add as much.
    assert np.abs(volume - wanted).max() < 2 * 2 * FRAME**2 / (0.1 * 5.0) * 1.2


@settings(max_examples=10, deadline=None)
@given(
    volume=st.floats(0.0, 5.0),
    low=st.floats(-200.0, 20.0),
    swing=st.floats(0.0, 400.0),
    d=st.floats(0.01, 20.0),
)
def test_limbs_stay_between_the_asymptotes_whatever_the_swing(
    fmu: Path, volume: float, low: float, swing: float, d: float
) -> None:
    lung = Lung(5.0, 0.1)
    lung.volume = volume
    range_ = {
        "pressure_low": f"{low!r} cmH2O",
        "pressure_high": f"{low + swing!r} cmH2O",
        "d": f"{d!r} cmH2O",
    }
    points = breathe(fmu, lung, FRAME, 3 * FRAMES, **{**SETTINGS, **range_})
    wanted = np.array([point["controller"]["target_volume"] for point in points[1:]])
    assert ((wanted >= A - 1e-12) & (wanted <= A + B + 1e-12)).all()  # a rounding
    for first, rising in ((0, True), (60, False), (120, True), (180, False)):
        steps = np.diff(wanted[first : first + 60])
        assert ((steps if rising else -steps) >= -1e-12).all()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"frames": 119}, "frames = 119: expected an even number"),
        ({"pressure_low": "40 cmH2O"}, "pressure_low = 40.0 cmH2O: expected at most pressure_high"),
    ],
)
def test_what_does_not_fit_is_refused(fmu: Path, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(FmuError) as caught:
        breathe(fmu, Lung(10.0, 0.05), 0.1, 1, **parameters)
    assert message in str(caught.value)
