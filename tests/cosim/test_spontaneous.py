"""Breathing by the patient's own effort: the closed forms of `cpap` and `muscle-effort`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from cosim import FmuError
from tests.cosim.helpers import Lung, breathe

RESISTANCE, COMPLIANCE = 10.0, 0.05
TAU = RESISTANCE * COMPLIANCE


@pytest.fixture(scope="module")
def cpap(shipped: Mapping[str, Path]) -> Path:
    return shipped["cpap"]


@pytest.fixture(scope="module")
def muscles(shipped: Mapping[str, Path]) -> Path:
    return shipped["muscle-effort"]


def errors(
    fmu: Path, closed: Callable[[float], float], end: float, **parameters: str
) -> list[float]:
    """Largest error of the volume at frames of 20, 10 and 5 ms."""
    result = []
    for count in (50, 100, 200):
        frame, steps = 1 / count, round(end * count)
        lung = Lung(RESISTANCE, COMPLIANCE)
        points = breathe(fmu, lung, frame, steps, frame=f"1/{count} s", **parameters)
        off = [abs(p["lung"]["volume"] - closed(i * frame)) for i, p in enumerate(points)]
        result.append(max(off))
    return result


def check_first_order(result: list[float], size: float) -> None:
    """Pressure held over a frame is late by half of one: an error of the order of the frame."""
    # Half a frame of the steepest rise, size/τ at most, with room for the second order.
    assert result[0] < 0.5 * 0.02 * size / TAU * 1.2
    ratios = np.array(result[:-1]) / np.array(result[1:])
    np.testing.assert_allclose(ratios, 2.0, rtol=0.05)  # the second order is 2 % of the first


def test_cpap_lung_follows_a_half_sine(cpap: Path) -> None:
    effort, length, omega = 6.0, 1.5, math.pi / 1.5

    def closed(time: float) -> float:
        wt = omega * min(time, length)
        size = COMPLIANCE * effort / (1 + (omega * TAU) ** 2)
        decay = math.exp(-min(time, length) / TAU)
        volume = size * (math.sin(wt) - omega * TAU * math.cos(wt) + omega * TAU * decay)
        return volume * math.exp(-max(time - length, 0.0) / TAU)

    message = {"pressure": "0 cmH2O", "effort": "6 cmH2O", "effort_time": "1.5 s"}
    check_first_order(errors(cpap, closed, 4.0, **message), COMPLIANCE * effort)


def test_cpap_lung_follows_the_ramp(cpap: Path) -> None:
    pressure, ramp = 8.0, 2.0

    def rising(time: float) -> float:
        return COMPLIANCE * pressure / ramp * (time - TAU * (1 - math.exp(-time / TAU)))

    def closed(time: float) -> float:
        if time <= ramp:
            return rising(time)
        top = COMPLIANCE * pressure
        return top + (rising(ramp) - top) * math.exp(-(time - ramp) / TAU)

    message = {"pressure": "8 cmH2O", "ramp_time": "2 s", "effort": "0 cmH2O"}
    result = errors(cpap, closed, 4.0, **message)
    # The ramp is reached at the end of a frame, so the pressure is half a frame early.
    check_first_order(result, COMPLIANCE * pressure)


def test_cpap_without_an_effort_is_one_pressure(cpap: Path) -> None:
    points = breathe(cpap, Lung(RESISTANCE, COMPLIANCE), 0.1, 50, effort="0 cmH2O", ramp_time="0 s")
    assert {point["controller"]["delta_p"] for point in points[1:]} == {8.0}


def muscle_pressure(time: float, top: float, period: float, rise: float, release: float) -> float:
    """Parabola, then an exponential that reaches 0 at the end of the breath."""
    time %= period
    fall = period - rise
    if time < rise:
        return top * time * (period - time) / (rise * fall)
    end = math.exp(-fall / release)
    return top * (math.exp(-(time - rise) / release) - end) / (1 - end)


def test_muscle_effort_moves_a_lung_as_the_convolution_says(muscles: Path) -> None:
    law = (10.0, 4.0, 1.6, 0.5)

    def closed(time: float) -> float:
        """∫ P(s)/R e^(−(t−s)/τ) ds, by quadrature."""
        kinks = [k for k in (1.6, 4.0, 5.6) if k < time]
        value, _ = quad(
            lambda s: muscle_pressure(s, *law) / RESISTANCE * math.exp((s - time) / TAU),
            0.0,
            time,
            points=kinks or None,
            limit=200,
        )
        return float(value)

    check_first_order(errors(muscles, closed, 6.0), COMPLIANCE * 10.0)


@settings(max_examples=10, deadline=None)
@given(
    top=st.floats(0.1, 30.0),
    rate=st.floats(5.0, 40.0),
    share=st.floats(0.1, 0.499),
    release=st.floats(0.05, 5.0),
)
def test_muscle_effort_is_its_law_at_every_frame(
    muscles: Path, top: float, rate: float, share: float, release: float
) -> None:
    period, frame = 60 / rate, 0.01
    points = breathe(
        muscles,
        Lung(RESISTANCE, COMPLIANCE),
        frame,
        round(1.5 * period / frame),
        effort=f"{top!r} cmH2O",
        rate=f"{rate!r} 1/min",
        inspiratory_time=f"{share * period!r} s",
        release_time=f"{release!r} s",
        frame="0.01 s",
    )
    given_ = [point["controller"]["delta_p"] for point in points[1:]]
    law = (top, period, share * period, release)
    # Frames are a millionth late: 1e-8 s of the steepest slope, that of the release or the rise.
    steepest = top * (period / (share * (1 - share) * period**2) + 1 / release) * 20
    for i, pressure in enumerate(given_):
        expected = muscle_pressure(i * frame + 1e-8, *law)
        assert pressure == pytest.approx(expected, abs=1e-8 * steepest)
    assert 0.0 <= min(given_) <= max(given_) <= top * (1 + 1e-12)


@pytest.mark.parametrize("release", [1e-6, 1e300])
def test_muscle_effort_takes_the_extremes_of_its_release(muscles: Path, release: float) -> None:
    points = breathe(
        muscles, Lung(RESISTANCE, COMPLIANCE), 0.1, 80, frame="0.1 s", release_time=f"{release} s"
    )
    given_ = np.array([point["controller"]["delta_p"] for point in points[1:]])
    times = np.arange(80) * 0.1 % 4.0
    # At once, or evenly; 1e-7 s of slack on slopes below 10 cmH2O/s.
    falling = 10.0 * (4.0 - times) / 2.4 if release > 1 else np.zeros(80)
    expected = np.where(times < 1.6 - 1e-9, 10.0 * times * (4.0 - times) / 3.84, falling)
    switch = np.isclose(times, 1.6)  # where an instant release has not yet begun
    np.testing.assert_allclose(given_[~switch], expected[~switch], atol=2e-6)


def test_contraction_longer_than_the_breath_is_refused(muscles: Path) -> None:
    with pytest.raises(FmuError, match=r"inspiratory_time = 2\.1 s: expected at most half"):
        breathe(muscles, Lung(10.0, 0.05), 0.1, 1, inspiratory_time="2.1 s")


def test_effort_longer_than_the_breath_is_refused(cpap: Path) -> None:
    with pytest.raises(FmuError, match=r"effort_time = 5\.0 s: expected less than"):
        breathe(cpap, Lung(10.0, 0.05), 0.1, 1, effort_time="5 s")
