from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from scenarios import Compartment, ScenarioError, breaths, fit_compartment


def _series(volume: ArrayLike, step: float = 0.1, **others: ArrayLike) -> xr.Dataset:
    data = {"volume": volume, **others}
    return xr.Dataset(
        {name: ("time", np.asarray(values, float)) for name, values in data.items()},
        coords={"time": np.arange(len(np.asarray(volume))) * step},
    )


def _breathing(tops: list[float], ends: list[float], inhaling: int, exhaling: int) -> xr.Dataset:
    """Straight up and down; a sample holds the phase of the step that ends there."""
    volume, phase, low = [1.0], [1.0], 1.0
    for top, end in zip(tops, ends, strict=True):
        volume += np.linspace(low, top, inhaling + 1)[1:].tolist()
        volume += np.linspace(top, end, exhaling + 1)[1:].tolist()
        phase += [1.0] * inhaling + [0.0] * exhaling
        low = end
    return _series(volume, phase=phase)


breath = st.tuples(st.floats(2.5, 4.0), st.floats(0.5, 2.0))


@given(
    volumes=st.lists(breath, min_size=1, max_size=5),
    inhaling=st.integers(1, 20),
    exhaling=st.integers(1, 20),
)
@settings(deadline=None, max_examples=40)
def test_breaths_follow_the_phase(
    volumes: list[tuple[float, float]], inhaling: int, exhaling: int
) -> None:
    tops, ends = (list(column) for column in zip(*volumes, strict=True))
    seen = breaths(_breathing(tops, ends, inhaling, exhaling))
    # The ends of the straight lines are exact; the differences round once.
    np.testing.assert_array_equal(seen["breath"], np.arange(1, len(tops) + 1))
    np.testing.assert_allclose(seen["end_inspiratory_volume"], tops, rtol=1e-15)
    np.testing.assert_allclose(seen["end_expiratory_volume"], ends, rtol=1e-15)
    np.testing.assert_allclose(seen["tidal_volume"], np.subtract(tops, ends), rtol=1e-14)
    np.testing.assert_allclose(seen["residual_volume"], np.array(ends) - 1.0, atol=1e-15)
    whole = 0.1 * (inhaling + exhaling)
    np.testing.assert_allclose(seen["duration"], whole, rtol=1e-12)
    np.testing.assert_allclose(seen["start"], whole * np.arange(len(tops)), rtol=1e-12)


def test_every_number_of_a_breath_has_a_unit_and_a_name() -> None:
    for variable in breaths(_breathing([3.0], [1.5], 5, 5)).data_vars.values():
        assert variable.attrs["units"] in ("L", "s")
        assert variable.attrs["long_name"]


@pytest.mark.parametrize("missing", [3, 10, 15, 19])
def test_an_unfinished_last_breath_is_left_out(missing: int) -> None:
    whole = _breathing([3.0, 3.2, 3.1], [1.5, 1.4, 1.6], 10, 10)
    seen = breaths(whole.isel(time=slice(None, -missing)))
    np.testing.assert_allclose(seen["end_expiratory_volume"], [1.5, 1.4], rtol=1e-15)


@pytest.mark.parametrize("status", ["failed: the valve is stuck", "interrupted"])
def test_a_first_breath_that_was_cut_short_is_none(status: str) -> None:
    whole = _breathing([3.0], [1.5], 10, 10)
    cut = whole.isel(time=slice(None, -5)).assign_attrs(status=status)
    assert breaths(cut).sizes["breath"] == 0


def test_without_a_phase_a_breath_begins_at_the_lowest_volume() -> None:
    time = np.arange(101) * 0.1  # 2.5 periods of 4 s, from the lowest point on
    seen = breaths(_series(2.0 - np.cos(2 * np.pi * time / 4.0)))
    np.testing.assert_allclose(seen["duration"], [4.0, 4.0], rtol=1e-12)
    np.testing.assert_allclose(seen["end_inspiratory_volume"], 3.0, rtol=1e-12)
    np.testing.assert_allclose(seen["residual_volume"], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    "dataset",
    [
        _series([2.0]),
        _series([2.0], phase=[1]),
        _series([2.0, 2.1, 2.2], phase=[1, 1, 1]),
        _series([2.0, 2.0, 2.0]),
        _series([2.0, 2.1, 2.2]),
    ],
)
def test_there_may_be_no_complete_breath(dataset: xr.Dataset) -> None:
    seen = breaths(dataset)
    assert seen.sizes["breath"] == 0
    assert seen["tidal_volume"].size == 0


lung = st.builds(
    Compartment,
    resistance=st.floats(1.0, 50.0),
    compliance=st.floats(0.02, 0.2),
    offset=st.floats(-100.0, 100.0),
)


def _run_of(lung: Compartment) -> xr.Dataset:
    time = np.linspace(0.0, 8.0, 121)
    volume = 2.0 + np.sin(1.3 * time) + 0.3 * time
    flow = 1.3 * np.cos(1.3 * time) + 0.3
    pressure = lung.resistance * flow + volume / lung.compliance + lung.offset
    return _series(volume, flow=flow, pressure=pressure)


@given(lung=lung)
@settings(deadline=None, max_examples=40)
def test_a_linear_lung_is_found_again(lung: Compartment) -> None:
    # Pressures of up to 300 cmH2O round by 3e-14, and the condition number is about 10.
    found = fit_compartment(_run_of(lung))
    assert found.resistance == pytest.approx(lung.resistance, rel=1e-10)
    assert found.compliance == pytest.approx(lung.compliance, rel=1e-10)
    assert found.offset == pytest.approx(lung.offset, abs=1e-10)


def test_the_sample_at_rest_is_left_out_of_the_fit() -> None:
    lung = Compartment(10.0, 0.1, -20.0)
    run = _run_of(lung)
    run["pressure"][0] = 0.0  # before any input, as a run begins
    assert fit_compartment(run).resistance == pytest.approx(10.0, rel=1e-10)


@pytest.mark.parametrize("volume", [np.full(20, 2.0), np.linspace(2.0, 3.0, 20)])
def test_a_run_that_does_not_tell_r_and_c_is_refused(volume: np.ndarray) -> None:
    flow = np.full(20, 0.0 if volume[0] == volume[-1] else 0.5)
    with pytest.raises(ScenarioError, match="do not determine a resistance and a compliance"):
        fit_compartment(_series(volume, flow=flow, pressure=volume))


def test_a_lung_that_pushes_itself_is_refused() -> None:
    with pytest.raises(ScenarioError, match="do not determine"):
        fit_compartment(_run_of(Compartment(10.0, -0.1, 0.0)))


@given(
    resistance=st.floats(2.0, 30.0),
    compliance=st.floats(0.02, 0.15),
    period=st.floats(2.0, 6.0),
    share=st.floats(0.2, 0.7),
)
@settings(deadline=None, max_examples=15)
def test_the_tidal_volume_is_that_of_the_equation_of_motion(
    resistance: float, compliance: float, period: float, share: float
) -> None:
    lung = Compartment(resistance, compliance, 0.0)
    inspiratory_time = share * period
    volume = 0.0
    cycles = int(25 * resistance * compliance / period) + 2  # to e⁻²⁵ of the periodic state
    for _ in range(cycles):
        top = _after(lung, volume, 15.0, inspiratory_time)
        volume = _after(lung, top, 0.0, period - inspiratory_time)
    # The integration is asked for 1e-9 of some 0.1 L.
    assert lung.tidal_volume(15.0, inspiratory_time, period) == pytest.approx(
        top - volume, rel=1e-6
    )


def _after(lung: Compartment, volume: float, pressure: float, span: float) -> float:
    solution = solve_ivp(
        lambda _, v: (pressure - v / lung.compliance) / lung.resistance,
        (0.0, span),
        [volume],
        method="LSODA",
        rtol=1e-9,
        atol=1e-12,
    )
    return float(solution.y[0, -1])
