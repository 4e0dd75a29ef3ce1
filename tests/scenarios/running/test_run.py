from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import scenarios
from cosim import FmuError, WiringError
from cosim.controllers import build, controller_source
from scenarios import Interrupted, Progress, RunError, Scenario, ScenarioError

UNSTABLE = {"integrator.method": "symplectic-euler", "integrator.safety": 3}


def test_another_controller_takes_over(small: Scenario, sphere: xr.Dataset) -> None:
    other = scenarios.run(small, "pressure-control")
    assert other.attrs["controller"] == "pressure-control"
    assert other.attrs["controller_sha256"] != sphere.attrs["controller_sha256"]
    # Its defaults: 5 cmH2O all the time and 15 more while inhaling, from the first step on. The
    # conversion to Pa and back costs two roundings.
    pressures = np.where(other["phase"][1:] == 1, 20.0, 5.0)
    np.testing.assert_allclose(other["delta_p"][1:], pressures, rtol=1e-15)
    np.testing.assert_allclose(other["pressure"][1:], pressures, rtol=1e-15)


def test_an_fmu_file_gives_what_the_shipped_controller_gives(
    small: Scenario, sphere: xr.Dataset, tmp_path: Path
) -> None:
    own = build(controller_source("paper"), tmp_path / "paper.fmu")
    swapped = scenarios.run(small, own)
    xr.testing.assert_equal(swapped, sphere)
    assert swapped.attrs["controller"] == str(own)
    # The build follows from the content alone.
    assert swapped.attrs["controller_sha256"] == sphere.attrs["controller_sha256"]


def test_an_fmu_file_takes_the_parameters_under_its_stem(small: Scenario, tmp_path: Path) -> None:
    own = build(controller_source("paper"), tmp_path / "paper.fmu")
    soft = small.changed({"controller.paper.vital_capacity": "1 L"})
    xr.testing.assert_equal(scenarios.run(soft, own), scenarios.run(soft))


def test_the_communication_step_does_not_matter(small: Scenario) -> None:
    # The controller acts at its frames of 1/30 s whatever the step, so only the body's own
    # integration differs. Its error is seen by a tolerance a hundred times smaller; two runs
    # that both have it may be twice as far apart.
    coarse = {"mesh.icosphere": 1, "integrator.tolerance": 1e-6}
    volumes = [
        _volume(small, {**coarse, "coupling.step": f"1/{rate} s"})[:: rate // 30]
        for rate in (30, 60, 120)
    ]
    error = np.abs(volumes[0] - _volume(small, {**coarse, "integrator.tolerance": 1e-8})).max()
    assert error < 1e-4  # the bound below means something: 3e-5 of the tidal volume
    assert np.abs(volumes[1] - volumes[0]).max() <= 2 * error
    assert np.abs(volumes[2] - volumes[0]).max() <= 2 * error


def test_jacobi_comes_nearer_to_gauss_seidel_with_the_step(small: Scenario) -> None:
    apart = []
    for rate in (30, 60, 120):
        changes = {"mesh.icosphere": 1, "coupling.step": f"1/{rate} s"}
        one_by_one = _volume(small, {**changes, "coupling.algorithm": "gauss-seidel"})
        at_once = _volume(small, {**changes, "coupling.algorithm": "jacobi"})
        apart.append(np.abs(one_by_one - at_once).max())
    # Jacobi lags by a step, in which 3 L/s make 0.1 L of 1/30 s; integration errs by 2e-4 L.
    assert apart[0] > 0.05
    assert apart[1] < 0.6 * apart[0]
    assert apart[2] < 0.6 * apart[1]


def test_progress_is_told_at_each_communication_point(small: Scenario) -> None:
    told: list[Progress] = []
    scenarios.run(small.changed({"mesh.icosphere": 1}), progress=told.append)
    np.testing.assert_array_equal([p.time for p in told], np.arange(121) * small.coupling.step)
    assert {p.duration for p in told} == {120 * small.coupling.step}
    assert np.all(np.diff([p.wall_time for p in told]) > 0)


def test_a_diverging_body_ends_the_run_with_what_went_before(small: Scenario) -> None:
    with pytest.raises(RunError) as caught:
        scenarios.run(small.changed(UNSTABLE))
    message, kept = str(caught.value), caught.value.dataset
    assert "t = " in message
    assert "volume" in message
    assert "Try " in message
    assert kept.attrs["status"] == f"failed: {message}"
    assert 1 <= kept.sizes["time"] < 121
    assert np.isfinite(kept["volume"]).all()


def test_an_exception_in_an_fmu_ends_the_run_with_what_went_before(
    small: Scenario, fmu: Callable[[str], Path]
) -> None:
    with pytest.raises(RunError) as caught:
        scenarios.run(small, fmu("stuck_valve"))
    assert "the valve is stuck" in str(caught.value)
    assert "t = 0.5 s" in str(caught.value)
    kept = caught.value.dataset
    assert kept.attrs["status"].startswith("failed: ")
    assert kept.sizes["time"] == 16  # 0 … 15/30 s
    assert float(kept["volume"][-1]) > float(kept["volume"][0])


def test_an_exception_in_the_first_step_leaves_the_body_at_rest(
    small: Scenario, fmu: Callable[[str], Path]
) -> None:
    at_once = small.changed({"controller.stuck_valve.at": "0 s"})
    with pytest.raises(RunError, match="the valve is stuck") as caught:
        scenarios.run(at_once, fmu("stuck_valve"))
    assert caught.value.dataset["time"].to_numpy().tolist() == [0.0]


def test_nan_from_an_fmu_names_the_connection(small: Scenario, fmu: Callable[[str], Path]) -> None:
    with pytest.raises(RunError, match=r"controller.delta_p → body.delta_p carries nan") as caught:
        scenarios.run(small, fmu("gives_nan"))
    assert caught.value.dataset.sizes["time"] == 16
    assert np.isfinite(caught.value.dataset["delta_p"]).all()


def test_an_interrupted_run_keeps_what_went_before(small: Scenario) -> None:
    def stop(progress: Progress) -> None:
        if progress.time > 0.99:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted, match="interrupted") as caught:
        scenarios.run(small, progress=stop)
    assert caught.value.dataset.attrs["status"] == "interrupted"
    assert caught.value.dataset["time"][-1] == 1.0


@pytest.mark.parametrize(
    ("controller", "error", "fragment"),
    [
        ("papper", ScenarioError, "did you mean 'paper'"),
        ("none.fmu", FmuError, "does not exist"),
    ],
)
def test_a_controller_that_is_not_there_is_an_error(
    small: Scenario, controller: str, error: type[Exception], fragment: str
) -> None:
    with pytest.raises(error, match=fragment):
        scenarios.run(small, controller)


@pytest.mark.parametrize(
    ("name", "fragment"),
    [
        ("drives_nothing", "neither an output delta_p .* nor an output n .*: drive"),
        ("wants_heart_rate", "input 'heart_rate' that the body does not give"),
    ],
)
def test_a_controller_that_does_not_fit_is_refused(
    small: Scenario, fmu: Callable[[str], Path], name: str, fragment: str
) -> None:
    with pytest.raises(WiringError, match=fragment):
        scenarios.run(small, fmu(name))


@pytest.mark.parametrize(
    ("changes", "fragment"),
    [
        ({"controller.paper.bnad": "1 L"}, "did you mean 'band'"),
        ({"controller.paper.band": 0.5}, "has no unit"),
        ({"controller.paper.band": "0.5 s"}, "cannot be converted"),
        ({"controller.paper.frames": 1}, "at least 2"),
        ({"controller.paper.frames": 3}, "expected an even number"),
        ({"controller.paper.law": "none"}, "expected 'limit', 'thermostat' or 'open'"),
    ],
)
def test_a_bad_parameter_of_the_controller_is_found_before_the_run(
    small: Scenario, changes: dict[str, object], fragment: str
) -> None:
    with pytest.raises(FmuError, match=fragment):
        scenarios.run(small.changed(changes))


@pytest.mark.parametrize("every", [0.0, -1.0, 0.01, float("nan"), float("inf")])
def test_positions_need_an_interval_of_a_step_or_more(small: Scenario, every: float) -> None:
    with pytest.raises(ScenarioError, match=r"positions every .* communication step, 0.0333333 s"):
        scenarios.run(small, positions_every=every)


def _volume(small: Scenario, changes: dict[str, object]) -> NDArray[np.float64]:
    return scenarios.run(small.changed(changes))["volume"].to_numpy()
