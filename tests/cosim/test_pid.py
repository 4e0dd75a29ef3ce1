"""PID control on a lung of one compartment, where its answer is known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cosim import FmuError
from tests.cosim.helpers import Lung, breathe

RESISTANCE, COMPLIANCE = 10.0, 0.05
TAU = RESISTANCE * COMPLIANCE
GAIN = 40.0  # cmH2O/L: a lag of R/K = 0.25 s
STEP = {
    "waveform": "square",
    "period": "20 s",
    "volume_low": "0 L",
    "volume_high": "0.5 L",
    "volume_gain": f"{GAIN} cmH2O/L",
    "integral_time": f"{TAU} s",
}
Points = list[Mapping[str, Mapping[str, float]]]


@pytest.fixture(scope="module")
def fmu(shipped: Mapping[str, Path]) -> Path:
    return shipped["pid"]


def follow(fmu: Path, count: int, end: float, **parameters: Any) -> Points:
    """Points of a run with `count` frames a second."""
    lung = Lung(RESISTANCE, COMPLIANCE)
    return breathe(fmu, lung, 1 / count, round(end * count), frame=f"1/{count} s", **parameters)


def column(points: Points, name: str, of: str = "lung") -> np.ndarray:
    return np.array([point[of][name] for point in points])


def test_volume_follows_a_step_with_one_lag(fmu: Path) -> None:
    result = []
    for count in (100, 200, 400):
        times = np.arange(2 * count + 1) / count
        closed = 0.5 * (1 - np.exp(-times * GAIN / RESISTANCE))
        volume = column(follow(fmu, count, 2.0, **STEP), "volume")
        result.append(np.abs(volume - closed).max())
    # Sampling delays the loop by half a frame: h/2 of the steepest slope, 0.5 K/R, and less.
    assert result[0] < 0.5 * 0.01 * 0.5 * GAIN / RESISTANCE
    np.testing.assert_allclose(np.divide(result[:-1], result[1:]), 2.0, rtol=0.05)


def test_volume_follows_a_sine_with_that_lag(fmu: Path) -> None:
    period, lag = 4.0, RESISTANCE / GAIN
    sine = {**STEP, "waveform": "sine", "period": f"{period} s"}
    volume = column(follow(fmu, 400, 16.0, **sine), "volume")[12 * 400 : -1]
    angle = 2 * np.pi * np.arange(len(volume)) / len(volume)
    first = 2 * np.mean(volume * np.exp(-1j * angle))
    expected = -0.25 / (1 + 2j * np.pi / period * lag)
    # The frame of 2.5 ms delays by half of itself: an angle of 2e-3.
    assert abs(first - expected) < 4e-3 * abs(expected)
    assert volume.mean() == pytest.approx(0.25, rel=1e-4)


def test_alveolar_pressure_follows_a_step_too(fmu: Path) -> None:
    parameters = {
        **STEP,
        "quantity": "pressure",
        "pressure_high": "10 cmH2O",
        "pressure_gain": GAIN * COMPLIANCE,  # the same loop
    }
    pressure = column(follow(fmu, 400, 2.0, **parameters), "alveolar_pressure")
    closed = 10.0 * (1 - np.exp(-np.arange(801) / 400 * GAIN / RESISTANCE))
    np.testing.assert_allclose(pressure, closed, atol=0.5 / 400 * 10.0 * GAIN / RESISTANCE)


def test_integral_does_not_wind_up_at_the_limit(fmu: Path) -> None:
    top = 11.0  # barely enough: 0.5 L takes 10 cmH2O
    points = follow(fmu, 100, 6.0, **STEP, delta_p_high=f"{top} cmH2O")
    volume, pressure = column(points, "volume"), column(points, "delta_p", "controller")
    times = np.arange(len(points)) / 100
    held = int(np.argmax(pressure[1:] < top))
    assert pressure.max() == top
    assert held * 0.01 > 0.3
    # At the limit the lung fills as under a constant pressure, exactly.
    filling = COMPLIANCE * top * (1 - np.exp(-times / TAU))
    np.testing.assert_allclose(volume[: held + 1], filling[: held + 1], rtol=1e-12)
    assert volume.max() < 0.5 * 1.01
    assert volume[-1] == pytest.approx(0.5, rel=1e-3)
    assert _without_anti_windup(top, 100, 6.0).max() > 0.5 * 1.05  # so the bound above says much


def _without_anti_windup(top: float, count: int, end: float) -> np.ndarray:
    volume, integral, outputs = 0.0, 0.0, []
    decay = math.exp(-1 / count / TAU)
    for _ in range(round(end * count)):
        error = 0.5 - volume
        rest = COMPLIANCE * min(GAIN * error + integral, top)
        integral += GAIN * error / TAU / count
        volume = rest + (volume - rest) * decay
        outputs.append(volume)
    return np.array(outputs)


def test_output_is_the_law_written_out(fmu: Path) -> None:
    gain, integral_time, derivative_time, frame = 30.0, 0.8, 0.2, 0.02
    parameters = {
        **STEP,
        "waveform": "sine",
        "period": "3 s",
        "volume_gain": f"{gain} cmH2O/L",
        "integral_time": f"{integral_time} s",
        "derivative_time": f"{derivative_time} s",
        "delta_p_high": "9 cmH2O",
        "delta_p_low": "1 cmH2O",
    }
    points = follow(fmu, 50, 6.0, **parameters)
    measured, given = column(points, "volume"), column(points, "delta_p", "controller")
    integral = derivative = 0.0
    last = measured[0]
    for i, y in enumerate(measured[:-1]):
        error = 0.5 * (1 - math.cos(2 * math.pi * (i * frame + 2e-8) / 3)) / 2 - y
        # The filter (Td/10) D' + D = −K Td y', by backward differences.
        lag = derivative_time / 10
        derivative = (lag * derivative - gain * derivative_time * (y - last)) / (lag + frame)
        last = y
        wanted = gain * error + integral + derivative
        limited = min(max(wanted, 1.0), 9.0)
        integral += frame / integral_time * (gain * error + limited - wanted)
        assert given[i + 1] == pytest.approx(limited, abs=1e-9)  # roundings, times gain and frames
    assert (given[1:].max(), given[1:].min()) == (9.0, 1.0)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"quantity": "flow"}, "quantity = 'flow': expected 'volume' or 'pressure'"),
        ({"waveform": "saw"}, "waveform = 'saw': expected 'sine' or 'square'"),
        ({"integral_time": "0.01 s"}, "integral_time = 0.01 s: expected at least one frame"),
        ({"delta_p_low": "200 cmH2O"}, "delta_p_low = 200.0 cmH2O: expected at most delta_p_high"),
        ({"volume_low": "4 L"}, "volume_low = 4.0 L: expected at most volume_high = 3.0 L"),
    ],
)
def test_what_does_not_fit_is_refused(fmu: Path, parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(FmuError) as caught:
        breathe(fmu, Lung(10.0, 0.05), 0.1, 1, **parameters)
    assert message in str(caught.value)
