from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

import scenarios
import scenarios.studies.trade.grid as grid_module
from scenarios.errors import RunError, ScenarioError
from scenarios.results.files import save
from scenarios.studies.trade.axes import AXES
from scenarios.studies.trade.order import convergence_order
from scenarios.studies.trade.pareto import front, pareto
from scenarios.studies.trade.plot import work_precision
from scenarios.studies.trade.reference import run_finely
from scenarios.studies.trade.settings import axis_values, put_all, read_axes, value_text
from softbody_core import INTEGRATORS, VelocityVerlet
from tests.scenarios.conftest import Cli

QUICK: dict[str, Any] = {
    "run.cycles": 1,
    "run.period": "1 s",
    "controller.paper.period": "1 s",
    "controller.paper.frames": 30,
    "mesh.icosphere": 1,
}
COUNTS = ["steps", "force_evaluations", "linear_solves"]
SCHEMES = {"integrator": ("symplectic-euler", "sdirk2"), "dt": (1.0, 0.5, 0.25)}


@pytest.fixture(scope="module")
def quick() -> scenarios.Scenario:
    """A breath of one second, of a sphere of 42 points."""
    return scenarios.load("sphere-lung", QUICK)


@pytest.fixture(scope="module")
def grid(quick: scenarios.Scenario) -> xr.Dataset:
    """Trade of two schemes. Shared: do not change it."""
    return scenarios.trade(quick, SCHEMES)


@pytest.fixture
def rough(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cheap reference, for what does not look at errors, or at large ones only."""
    monkeypatch.setattr(grid_module, "PARTS", 2)


def test_every_cell_has_an_error_and_a_cost(grid: xr.Dataset) -> None:
    assert grid.sizes == {"integrator": 2, "dt": 3}
    assert (grid["status"] == "completed").all()
    for name, variable in grid.data_vars.items():
        assert variable.dims == ("integrator", "dt"), name
        assert variable.attrs["units"], name
        assert variable.attrs["long_name"], name
    for name in ("error", "end_expiratory_error", "wall_time_per_second", "force_evaluations"):
        assert (grid[name] > 0).all(), name
    assert (grid["linear_solves"].sel(integrator="symplectic-euler") == 0).all()
    assert (grid["linear_solves"].sel(integrator="sdirk2") > 0).all()


def test_the_error_falls_at_the_declared_order(grid: xr.Dataset) -> None:
    errors = grid["error"].sel(integrator="sdirk2")
    assert errors[-1] > 10 * grid.attrs["reference_error"]
    order = np.polyfit(np.log(grid["dt"]), np.log(errors), 1)[0]
    # the longest step is a frame, over which the inputs jump: the next term is still seen there
    assert order == pytest.approx(2, abs=0.25)


def test_an_implicit_scheme_divides_the_communication_step(grid: xr.Dataset) -> None:
    assert_array_equal(grid["steps"].sel(integrator="sdirk2"), [30, 60, 120])


def test_an_explicit_scheme_divides_its_stability_limit(grid: xr.Dataset) -> None:
    steps = grid["steps"].sel(integrator="symplectic-euler").to_numpy()
    # each of the 30 communication steps rounds its number of substeps up
    assert_allclose(steps[1:] / steps[:-1], 2, atol=60 / steps[0])


def test_a_cell_is_the_run_that_its_scenario_gives(
    quick: scenarios.Scenario, grid: xr.Dataset
) -> None:
    cell = put_all(quick, {"integrator": "symplectic-euler", "dt": 0.5})
    assert cell is not None
    run = scenarios.run(cell)
    against, error = scenarios.reference(quick)
    measured = grid.sel(integrator="symplectic-euler", dt=0.5)
    assert grid.attrs["reference_error"] == error
    assert measured["error"] == scenarios.volume_error(run, against)
    for name in COUNTS:
        assert measured[name] == run.attrs[name]
    ends = [float(scenarios.breaths(d)["end_expiratory_volume"][-1]) for d in (run, against)]
    assert measured["end_expiratory_error"] == abs(ends[0] - ends[1])


@pytest.mark.usefixtures("rough")
def test_counts_repeat_exactly(quick: scenarios.Scenario, grid: xr.Dataset) -> None:
    again = scenarios.trade(quick, {**SCHEMES, "dt": (1.0,)})
    xr.testing.assert_equal(again[COUNTS], grid[COUNTS].sel(dt=[1.0]))


def test_the_reference_agrees_with_another_scheme(quick: scenarios.Scenario) -> None:
    """RK4 at its stability limit errs by far less: its error, and so the reference's, is small."""
    inhaling = quick.changed({"run.period": "0.5 s"})
    against, error = scenarios.reference(inhaling)
    rk4 = scenarios.run(inhaling.changed({"integrator": {"method": "rk4"}}))
    assert 0 < scenarios.volume_error(rk4, against) < error


def test_the_reference_is_checked_by_halving_its_step(quick: scenarios.Scenario) -> None:
    against, error = scenarios.reference(quick, parts=4)
    assert against.attrs["steps"] == 30 * 8
    assert error == scenarios.volume_error(run_finely(quick, 4), against)


@pytest.mark.usefixtures("rough")
def test_the_volume_converges_with_the_number_of_points() -> None:
    """Flat triangles and lumped points: second order in the edge length."""
    inhaling = scenarios.load("sphere-lung", {**QUICK, "run.period": "0.5 s"})
    trade = scenarios.trade(inhaling, {"points": (642, 42, 162)})
    assert_array_equal(trade["points"], [42, 162, 642])
    changes = trade["points_change"].to_numpy()
    assert changes[0] > 3 * changes[1]
    assert np.isnan(changes[2])
    # 42 points are few: their change holds terms of higher order, 2.09 is measured
    assert trade.attrs["points_order"] == pytest.approx(2, abs=0.25)
    assert (np.diff(trade["error"]) < 0).all()
    # the error of a coarse mesh is how far it is from the finest one
    assert trade["error"][0] == pytest.approx(changes.sum(where=~np.isnan(changes)), rel=0.05)


@pytest.mark.usefixtures("rough")
def test_a_lag_shrinks_with_the_communication_step(quick: scenarios.Scenario) -> None:
    """The controller is sampled, so without a lag the communication step changes nothing."""
    steps = tuple(quick.coupling.step / parts for parts in (1, 2))
    fine = quick.changed({"integrator": {"method": "sdirk2", "tolerance": 1e-6}})
    axes = {"algorithm": ("gauss-seidel", "jacobi"), "communication_step": steps}
    errors = scenarios.trade(fine, axes)["error"]
    assert (errors.sel(algorithm="gauss-seidel") < 1e-4).all()
    lagged = errors.sel(algorithm="jacobi").to_numpy()
    assert lagged[0] / lagged[1] == pytest.approx(2, rel=0.3)  # of first order in the lag


@pytest.mark.usefixtures("rough")
def test_a_cell_that_fails_says_why_and_the_others_run(quick: scenarios.Scenario) -> None:
    unstable = {"method": "symplectic-euler", "safety": 3.0}
    trade = scenarios.trade(
        quick.changed({"integrator": unstable}), {"integrator": ("symplectic-euler", "sdirk2")}
    )
    status = trade["status"].to_numpy()
    assert status[0].startswith("failed: the body diverged")
    assert status[1] == "completed"
    for name in ("error", "wall_time_per_second", *COUNTS):
        assert_array_equal(np.isnan(trade[name]), [True, False])
    assert_array_equal(front(trade), [False, True])


@pytest.mark.usefixtures("rough")
def test_a_slow_cell_is_stopped_and_shorter_steps_are_left_out(quick: scenarios.Scenario) -> None:
    status = scenarios.trade(quick, SCHEMES, limit=1e-9)["status"]
    assert (status[:, 0] == "stopped: it took more than 1e-09 s").all()
    assert (status[:, 1:] == "stopped: a longer step took too long").all()


@pytest.mark.usefixtures("rough")
def test_an_axis_that_means_nothing_to_a_scheme_leaves_its_cells_empty(
    quick: scenarios.Scenario,
) -> None:
    axes = {"integrator": ("velocity-verlet", "sdirk2"), "tolerance": (1e-2, 1e-3)}
    trade = scenarios.trade(quick, axes)
    assert (trade["status"][0] == grid_module.MEANS_NOTHING).all()
    assert (trade["status"][1] == "completed").all()


@pytest.mark.usefixtures("rough")
def test_an_interruption_keeps_what_was_computed(
    cli: Cli, monkeypatch: pytest.MonkeyPatch, quick: scenarios.Scenario
) -> None:
    runs = 0

    def run(*arguments: Any, **options: Any) -> xr.Dataset:
        nonlocal runs
        runs += 1
        if runs == 2:
            raise KeyboardInterrupt
        return scenarios.run(*arguments, **options)

    monkeypatch.setattr(grid_module, "run", run)
    Path("quick.toml").write_text(quick.text)
    said = cli("trade", "quick.toml", "--axis", "tolerance=1e-2:1e-3:1e-4")
    assert said.code == 130
    trade = xr.load_dataset("trade.nc")
    assert trade.attrs["status"] == "interrupted"
    assert list(trade["status"].to_numpy()) == ["completed", "not reached", "not reached"]
    assert Path("trade.png").exists()


@pytest.mark.usefixtures("rough")
def test_an_interruption_inside_a_run_ends_the_trade(quick: scenarios.Scenario) -> None:
    def watch(at: scenarios.GridProgress) -> None:
        if at.name == "tolerance 0.001" and at.done > 2.5:
            raise KeyboardInterrupt

    with pytest.raises(RunError, match="interrupted") as caught:
        scenarios.trade(quick, {"tolerance": (1e-2, 1e-3)}, progress=watch)
    assert list(caught.value.dataset["status"].to_numpy()) == ["completed", "not reached"]


@pytest.mark.usefixtures("rough")
def test_a_reference_that_fails_ends_the_trade_with_a_file(
    cli: Cli, fmu: Callable[[str], Path]
) -> None:
    said = cli("trade", "sphere-lung", "--controller", str(fmu("gives_nan")))
    assert said.code == 3
    assert "error: the reference: " in said.error
    assert "there is no reference" in said.out
    trade = xr.load_dataset("trade.nc")
    assert trade.attrs["status"].startswith("failed: the reference: ")
    assert (trade["status"] == "not reached").all()
    assert Path("trade.png").exists()


@pytest.mark.usefixtures("rough")
def test_progress_names_each_run_and_counts_to_the_end(quick: scenarios.Scenario) -> None:
    seen: list[scenarios.GridProgress] = []
    scenarios.trade(quick, {"dt": (1.0, 0.5)}, progress=seen.append)
    assert list(dict.fromkeys(at.name for at in seen)) == ["reference", "dt 1", "dt 0.5"]
    done = [at.done for at in seen]
    assert done == sorted(done)
    assert (done[0], done[-1], seen[-1].total) == (0.0, 3.0, 3)


@pytest.mark.usefixtures("rough")
def test_one_line_writes_a_dataset_and_a_plot_and_prints_the_front(
    cli: Cli, quick: scenarios.Scenario
) -> None:
    Path("quick.toml").write_text(quick.text)
    said = cli("trade", "quick.toml", "--axis", "integrator=symplectic-euler:sdirk2,dt=1:0.5")
    assert (said.code, said.error) == (0, "")
    trade = xr.load_dataset("trade.nc")
    assert trade.sizes == {"integrator": 2, "dt": 2}
    again = Path("again.toml")
    again.write_text(trade.attrs["scenario"])
    assert scenarios.load(again).integrator == quick.integrator
    best = front(trade)
    for integrator in ("symplectic-euler", "sdirk2"):
        for dt, word in ((1.0, "1"), (0.5, "0.5")):
            printed = f"* {integrator} {word} " in said.out
            assert printed == bool(best.sel(integrator=integrator, dt=dt))
    for fragment in ("4 of 4 cells have a result", "Halving its step changes it by", "trade.png"):
        assert fragment in said.out
    assert Path("trade.png").stat().st_size > 10_000
    assert "again.nc" in cli("trade", "quick.toml", "--axis", "dt=1", "-o", "again.nc").out


def test_a_trade_survives_its_file(grid: xr.Dataset, tmp_path: Path) -> None:
    save(grid, tmp_path / "trade.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "trade.nc"), grid)


@pytest.mark.parametrize(
    ("arguments", "fragments"),
    [
        (("--axis", "integrater"), ["axis = 'integrater'", "did you mean 'integrator'?"]),
        (("--axis", "colour"), ["axis = 'colour'", "known: algorithm, communication_step, dt"]),
        (("--axis", "dt,dt"), ["axis 'dt' is named twice"]),
        (("--axis", "dt=long"), ["axis dt = 'long' cannot be read", "colon"]),
        (("--axis", "dt=2"), ["dt = 2", "at most 1"]),
        (("--axis", "dt=1:1"), ["axis dt", "each one once"]),
        (("--axis", "integrator=rk5"), ["integrator = 'rk5'", "'rk4'"]),
        (("--axis", "points=163"), ["points = 163", "expected one of 12, 42, 162, 642"]),
        (("--axis", "communication_step=1 kg"), ["communication_step", "'1 kg'", "'s'"]),
        (("--axis", "communication_step=0.7 s"), ["coupling.step = 0.7 s does not divide"]),
        (("--limit", "0 s"), ["limit = 0 s", "positive"]),
        (("--cycles", "0"), ["run.cycles = 0"]),
        (("-o", "trade.png"), ["trade.png", "ends in .nc"]),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_bad_input_is_told_before_anything_runs(
    cli: Cli, tmp_path: Path, arguments: tuple[str, ...], fragments: list[str]
) -> None:
    said = cli("trade", "sphere-lung", *arguments)
    assert said.code == 2
    for fragment in fragments:
        assert fragment in said.error
    assert list(tmp_path.iterdir()) == []


def test_the_plot_has_a_line_for_each_scheme_and_rings_on_the_front(grid: xr.Dataset) -> None:
    axes = work_precision(grid).axes[0]
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert "s/s" in axes.get_xlabel()
    lines = {str(line.get_label()): line for line in axes.lines}
    for scheme in SCHEMES["integrator"]:
        cells = grid.sel(integrator=scheme)
        assert_array_equal(lines[scheme].get_xdata(), cells["wall_time_per_second"])
        assert_array_equal(lines[scheme].get_ydata(), cells["error"])
    rings = np.asarray(lines["Pareto front"].get_xdata(), float)
    assert_array_equal(rings, grid["wall_time_per_second"].to_numpy()[front(grid)])


def test_errors_that_the_reference_cannot_tell_apart_are_equal(grid: xr.Dataset) -> None:
    """Then the cheapest of them is on the front, and none is drawn below the limit."""
    vague = grid.assign_attrs(reference_error=1.0)
    best = front(vague).to_numpy()
    assert best.sum() == 1
    assert grid["wall_time_per_second"].to_numpy()[best] == float(
        grid["wall_time_per_second"].min()
    )
    lines = {str(line.get_label()): line for line in work_precision(vague).axes[0].lines}
    assert_array_equal(lines["sdirk2"].get_ydata(), 3.0)


Numbers = st.floats(0, 10) | st.integers(0, 3).map(float) | st.just(float("nan"))


@given(st.lists(st.tuples(Numbers, Numbers), min_size=1, max_size=25))
def test_the_front_is_what_nothing_beats(points: list[tuple[float, float]]) -> None:
    errors, costs = np.array(points).T
    on_front = pareto(errors, costs)
    finite = np.isfinite(errors) & np.isfinite(costs)

    def beats(a: int, b: int) -> bool:
        no_worse = errors[a] <= errors[b] and costs[a] <= costs[b]
        return bool(no_worse and (errors[a] < errors[b] or costs[a] < costs[b]))

    for i in range(len(points)):
        rivals = [j for j in range(len(points)) if finite[j] and beats(j, i)]
        assert on_front[i] == (finite[i] and not rivals)
        # what is beaten is beaten by something on the front: the front alone tells all
        assert not finite[i] or on_front[i] or any(on_front[j] for j in rivals)


def test_the_front_has_the_shape_of_the_grid() -> None:
    assert_array_equal(pareto([[1, 2], [3, 1]], [[4, 3], [1, 9]]), [[True, True], [True, False]])


@given(st.floats(0.5, 5), st.floats(1e-6, 1e3))
def test_an_order_is_found_in_sizes_of_any_ratio(order: float, scale: float) -> None:
    for points in ([162, 642, 2562], [770, 1730, 3074], [50, 100, 300, 700]):
        powers = np.array(points, float) ** (-order / 2)
        changes = scale * (powers[:-1] - powers[1:])
        # 1e-4: the minimum is flat, and found to 1e-5
        assert convergence_order(np.array(points) ** -0.5, list(changes)) == pytest.approx(
            order, abs=1e-4
        )


def test_two_meshes_have_no_order() -> None:
    assert np.isnan(convergence_order([0.1, 0.05], [0.1]))


def test_curves_are_compared_at_the_times_that_they_share() -> None:
    def curve(times: Any, volumes: Any) -> xr.Dataset:
        return xr.Dataset({"volume": ("time", np.asarray(volumes, float))}, {"time": times})

    fine = curve(np.arange(7) / 6, [0, 1, 2, 3, 4, 3, 2])
    assert scenarios.volume_error(fine, fine) == 0
    # at 1/3 s it is 0.2 off, and the reference spans 4; at the other times it agrees
    assert scenarios.volume_error(curve(np.arange(4) / 3, [0, 2.2, 4, 2]), fine) == (
        pytest.approx(0.05)
    )
    with pytest.raises(ScenarioError, match="times in common"):
        scenarios.volume_error(curve([0.0, 0.4], [0, 1]), fine)
    with pytest.raises(ScenarioError, match="changes by 0 L"):
        scenarios.volume_error(fine, curve(fine["time"], np.ones(7)))


def test_every_axis_has_values_for_a_lung() -> None:
    lung = scenarios.load("lung")
    values = axis_values(lung, list(AXES))
    assert values["points"] == (770, 1730, 3074)
    assert values["communication_step"] == pytest.approx((1 / 30, 1 / 60, 1 / 120))
    for name, own in values.items():
        for value in own:
            cell = put_all(lung, {name: value})
            assert cell is not None
            as_it_is = (lung.coupling.step, "gauss-seidel", "constant", 1730, "sdirk2")
            assert cell != lung or value in as_it_is


@pytest.mark.parametrize("method", INTEGRATORS)
def test_every_scheme_has_a_knob_that_the_axis_dt_turns(
    quick: scenarios.Scenario, method: str
) -> None:
    whole = put_all(quick, {"integrator": method, "dt": 1.0})
    half = put_all(quick, {"integrator": method, "dt": 0.5})
    assert whole is not None
    assert half is not None
    assert type(whole.integrator) is type(half.integrator) is INTEGRATORS[method]
    assert half.integrator != whole.integrator


def test_a_scenario_without_a_table_for_its_scheme_can_be_refined(tmp_path: Path) -> None:
    text = scenarios.load("sphere-lung").text
    (tmp_path / "plain.toml").write_text(text.replace('[integrator]\nmethod = "sdirk2"', ""))
    plain = scenarios.load(tmp_path / "plain.toml")
    half = put_all(plain, {"dt": 0.5})
    assert half is not None
    assert half.integrator == VelocityVerlet(safety=0.45)


def test_meshes_come_in_their_sizes(tmp_path: Path) -> None:
    lung = put_all(scenarios.load("lung"), {"points": 770})
    assert lung is not None
    assert lung.mesh.lung == "lung-right-770"
    text = scenarios.load("sphere-lung").text
    (tmp_path / "ball.toml").write_text(text.replace("icosphere = 3", "ball = 100"))
    ball = scenarios.load(tmp_path / "ball.toml")
    assert axis_values(ball, ["points"])["points"] == (162, 642, 2562)
    changed = put_all(ball, {"points": 60})
    assert changed is not None
    assert changed.mesh.ball == 60
    (tmp_path / "file.toml").write_text(text.replace("icosphere = 3", 'file = "mine.ply"'))
    with pytest.raises(ScenarioError, match="a mesh that comes in several sizes"):
        axis_values(scenarios.load(tmp_path / "file.toml"), ["points"])


def test_numbers_are_told_briefly() -> None:
    assert [value_text(value) for value in (1.0, 0.5, 1 / 32, 1e-4, 642, "rk4")] == [
        "1", "0.5", "1/32", "0.0001", "642", "rk4",
    ]  # fmt: skip


def test_axes_are_read_with_their_values() -> None:
    read = read_axes("integrator, dt=1:0.5,communication_step=1/30 s:1/60 s")
    assert read == {
        "integrator": None,
        "dt": (1.0, 0.5),
        "communication_step": pytest.approx((1 / 30, 1 / 60)),
    }
