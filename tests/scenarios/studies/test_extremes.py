"""The map of extremes: that it is right where it says so, and calls a defect a defect."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import scenarios
from scenarios.commands import extremes as command
from scenarios.running.progress import StudyProgress
from scenarios.studies.extremes import Outcome, picture, survey
from scenarios.studies.extremes import verdict as verdicts
from scenarios.studies.extremes.axes import AXES
from scenarios.studies.extremes.cases import STEPS, Case
from scenarios.studies.extremes.limits import (
    bare_springs,
    explicit_schemes,
    largest_eigenvalue,
    measured_limit,
    stays_small,
)
from scenarios.studies.extremes.trial import OverTime, Trial, try_case
from scenarios.studies.extremes.verdict import Reference, judge, refer
from softbody_core import (
    INTEGRATORS,
    RK4,
    SDIRK2,
    AirwayResistance,
    DivergenceError,
    Gravity,
    InternalPressure,
    MassSpring,
    SoftBodyModel,
    State,
    SurfaceSPH,
)
from softbody_core.configuration import Configuration
from softbody_core.integrators import Counters, Stepper
from tests.core import tangents

SECONDS = 10.0


@pytest.fixture(scope="module")
def case():
    """A sphere of 162 points under the map's benign drive."""
    return Case.of(scenarios.load("sphere-lung", {"mesh.icosphere": 2}))


@pytest.fixture(scope="module")
def reference(case):
    return refer(case, SECONDS)


@pytest.fixture(scope="module")
def reduced():
    return survey(
        scenarios.load("sphere-lung", {"mesh.icosphere": 2}), reduced=True, seconds=SECONDS
    )


# The reduced map


@pytest.mark.parametrize("axis", AXES)
def test_the_reduced_map_has_no_defect(reduced, axis):
    seen = reduced.isel(case=np.flatnonzero(reduced["axis"] == axis))
    assert seen.sizes["case"] == len(AXES[axis].few)
    flat = seen.stack(cell=("case", "integrator"), create_index=False)
    bad = flat.isel(cell=np.flatnonzero(flat["outcome"] == Outcome.DEFECT))
    names = ("setting", "integrator", "message")
    defects = list(zip(*(bad[name].to_numpy().tolist() for name in names), strict=True))
    assert defects == []


def test_every_integrator_is_on_the_map_and_right_where_nothing_is_extreme(reduced):
    assert reduced["integrator"].to_numpy().tolist() == list(INTEGRATORS)
    plain = reduced.isel(case=np.flatnonzero(reduced["setting"] == "as it is")[0])
    assert (plain["outcome"] == Outcome.RIGHT).all()


def test_an_error_on_the_map_has_a_name(reduced):
    ended = reduced["outcome"].to_numpy() == Outcome.ERROR
    names = {message.split(":")[0] for message in reduced["message"].to_numpy()[ended]}
    assert {"ParameterError", "MeshError", "StepLimitError", "DivergenceError"} <= names
    assert all(name.endswith("Error") for name in names)


def test_the_map_is_described(reduced):
    assert reduced["outcome"].attrs["flag_meanings"] == "right bounded error defect"
    for name, variable in reduced.data_vars.items():
        assert "long_name" in variable.attrs, name
        assert "units" in variable.attrs or variable.dtype.kind in "UOT" or name == "outcome", name


def test_the_picture_has_a_panel_for_each_axis_and_crosses_out_defects(reduced):
    def crosses(dataset):
        panels = picture(dataset).get_axes()
        return sum(text.get_text() == "×" for axes in panels for text in axes.texts)

    titles = [axes.get_title().split(" ")[0] for axes in picture(reduced).get_axes()]
    assert set(AXES) <= set(titles)
    worse = reduced.copy(deep=True)
    worse["outcome"][2, 0] = Outcome.DEFECT
    already = int((reduced["outcome"] == Outcome.DEFECT).sum())
    assert crosses(worse) == already + 1


# The truth behind it


def test_a_case_in_its_own_units():
    case = Case.of(scenarios.load("sphere-lung", {"mesh.icosphere": 1}))
    case = replace(case.with_law(SurfaceSPH), mass=2.0, dt=0.5).with_radius(0.25)
    own = case.in_own_units()
    assert (own.mass, own.dt) == (1.0, 1.0)
    assert own.radius == pytest.approx(1.0)
    laws = {type(law): law for law in own.forces}
    kg, m, s = 2.0, 0.25, 0.5
    assert laws[MassSpring].stiffness == pytest.approx(375 / (kg / s**2))
    assert laws[MassSpring].damping == pytest.approx(0.1 / (kg / s))
    assert laws[SurfaceSPH].gas_constant == pytest.approx(30 / (m**2 / s**2))
    assert laws[SurfaceSPH].core_radius == 2.0
    assert laws[InternalPressure].gas_energy == pytest.approx(2e-3 / (kg * m**2 / s**2))
    # a cmH2O.s/L is 98 066.5 Pa.s/m³
    assert laws[AirwayResistance].resistance == pytest.approx(980665 / (kg / m**4 / s))
    assert own.inputs.delta_p == pytest.approx(200 / (kg / m / s**2))
    assert own.inputs.n == case.inputs.n


def test_the_reference_agrees_with_another_integrator_in_other_units():
    """SciPy's eighth-order scheme, on the case as it stands."""
    case = Case.of(scenarios.load("sphere-lung", {"mesh.icosphere": 1}))
    case = replace(case.with_law(SurfaceSPH), forces=(*case.forces, Gravity(1.0)))
    found = refer(case, SECONDS)
    assert found.trial is not None
    model = SoftBodyModel(case.mesh, case.mass, case.forces, case.weights)

    def derivative(_, y):
        x, v = y.reshape(2, 3, -1)
        force = model.total_force(Configuration(case.mesh, x), v, case.inputs)
        return np.concatenate([v.ravel(), (model.inverse_masses * force).ravel()])

    start = State.at_rest(case.mesh)
    y0 = np.concatenate([start.positions.ravel(), start.velocities.ravel()])
    solution = solve_ivp(derivative, (0, STEPS * case.dt), y0, method="DOP853", rtol=1e-9)
    exact = solution.y[:, -1].reshape(2, 3, -1)[0].T
    apart = found.trial.points - (exact - case.mesh.points.mean(axis=0)) / case.radius
    moved = np.linalg.norm(exact - case.mesh.points, axis=1).max() / case.radius
    assert moved > 0.05
    # the two tolerances of a reference may differ by half of RIGHT_WITHIN
    assert np.sqrt(np.mean(np.sum(apart**2, axis=1))) < verdicts.RIGHT_WITHIN / 2


def test_the_reference_of_a_long_case_is_the_closed_form_of_a_sphere(case):
    found = refer(replace(case, dt=20.0), SECONDS)
    assert found.trial is not None
    rest, stiffness, energy = case.radius, 375.0, 2e-3

    def imbalance(radius):
        elastic = 2 * np.sqrt(3) * stiffness * (1 / radius - rest / radius**2)
        return energy * case.inputs.n / (2 * radius) ** 3 + case.inputs.delta_p - elastic

    exact = (brentq(imbalance, rest, 1.5 * rest) / rest) ** 3
    assert exact > 1.05
    # an icosphere of 162 points is a coarse membrane: a tenth of the change of volume
    assert found.trial.volume_ratio - 1 == pytest.approx(exact - 1, rel=0.1)


def test_there_is_no_reference_where_tight_runs_disagree(case, monkeypatch):
    monkeypatch.setattr(verdicts, "_TOLERANCES", (1.0, 1e-4))
    swinging = case.with_law(AirwayResistance, resistance=0.0).with_inputs(delta_p=1500.0)
    found = refer(replace(swinging, dt=0.1), SECONDS)
    assert found.trial is None
    assert "differ by" in found.how_known


# Verdicts on integrators that misbehave on purpose


@dataclass(frozen=True)
class Misbehaving:
    """Does to the body whatever `act` says."""

    act: object
    order: ClassVar[int] = 1

    def bind(self, model):
        return _Misbehaving(self.act, model)


class _Misbehaving(Stepper):
    def __init__(self, act, model):
        self.counters, self._act, self._model = Counters(), act, model

    def advance(self, state, inputs, dt):
        moved = self._act(state, inputs, self._model)
        return State(state.time + dt, moved, state.velocities)


def grow(factor):
    return lambda state, *_: state.positions * factor ** (1 / STEPS)


def mirror(state, inputs, model):
    return -state.positions


def give_nan(state, inputs, model):
    return state.positions * np.nan


def sleep(state, inputs, model):
    time.sleep(0.1)
    return state.positions


def hang(state, inputs, model):
    while True:
        model.total_force(Configuration(model.mesh, state.positions), state.velocities, inputs)


def fail_foreign(state, inputs, model):
    raise ZeroDivisionError("by zero")


def fail_named(state, inputs, model):
    raise DivergenceError(state.time, "volume", 7.0, "a rest")


def fail_and_spoil(state, inputs, model):
    state.positions[0, 0] += 1e-12
    raise DivergenceError(state.time, "volume", 7.0, "a rest")


@pytest.mark.parametrize(
    ("act", "outcome", "said"),
    [
        (give_nan, Outcome.DEFECT, "not finite"),
        (grow(20.0), Outcome.DEFECT, "silent runaway: the volume is"),
        (mirror, Outcome.DEFECT, "silent runaway: the volume is -"),
        (grow(3.0), Outcome.DEFECT, "silent runaway: 27 V0 where the reference has"),
        (grow(0.1), Outcome.DEFECT, "silent runaway: 0.001 V0"),
        (grow(1.1), Outcome.BOUNDED, "1.331 V0 where the reference has"),
        (grow(1.0), Outcome.BOUNDED, "1 V0 where the reference has"),
        (sleep, Outcome.DEFECT, "over time"),
        (fail_foreign, Outcome.DEFECT, "ZeroDivisionError: by zero"),
        (fail_named, Outcome.ERROR, "DivergenceError: the body diverged at t = 0 s: volume"),
        (fail_and_spoil, Outcome.DEFECT, "last good state is lost"),
    ],
)
def test_a_bad_integrator_gets_its_verdict(case, reference, act, outcome, said):
    seconds = 0.2 if act is sleep else SECONDS
    seen = judge(try_case(case, Misbehaving(act), seconds), reference)
    assert (seen.outcome, said in seen.message) == (outcome, True), seen.message


def test_a_good_integrator_is_right(case, reference):
    seen = judge(try_case(case, SDIRK2(), SECONDS), reference)
    assert seen.outcome is Outcome.RIGHT
    assert 0 < seen.difference < verdicts.RIGHT_WITHIN


def test_a_loop_without_end_is_ended(case, reference):
    trial = try_case(case, Misbehaving(hang), 0.2)
    assert isinstance(trial.failure, OverTime)
    assert 0.2 <= trial.wall_time < 2.0
    assert judge(trial, reference).outcome is Outcome.DEFECT


def test_a_shipped_integrator_is_ended_too(case):
    """Its forces are asked for through the model, so the watch sees them."""
    trial = try_case(case.with_law(MassSpring, stiffness=1e6), RK4(), 0.2)
    assert isinstance(trial.failure, OverTime)
    assert trial.wall_time < 2.0


def test_without_a_reference_nothing_is_right(case):
    seen = judge(try_case(case, SDIRK2(), SECONDS), Reference(None, "it was late"))
    assert seen.outcome is Outcome.BOUNDED
    assert seen.message.endswith("with nothing to compare it to: it was late")


def test_infinite_observations_are_a_defect(reference):
    trial = Trial(None, finite=False, volume_ratio=1.0)
    assert judge(trial, reference).outcome is Outcome.DEFECT


# Stability limits


def test_the_eigenvalue_is_that_of_the_dense_matrix(tetrahedron):
    model = SoftBodyModel(tetrahedron, 2.0, [MassSpring(3.0)])
    rest = Configuration(tetrahedron, State.at_rest(tetrahedron).positions)
    matrix = tangents.stiffness(model.terms[0][1], rest, None).toarray()
    exact = np.linalg.eigvals(matrix / np.tile(model.masses, 3)[:, None]).real.max()
    assert largest_eigenvalue(model) == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("name", explicit_schemes())
def test_measured_limits_are_those_of_theory(case, name):
    """Each integrator says its own: 2/ω, and √8/ω for the classical Runge-Kutta one."""
    model = bare_springs(case, 1e3)
    unit = 2 / np.sqrt(largest_eigenvalue(model))
    limit = explicit_schemes()[name].stability_limit
    assert np.isfinite(limit), (
        f"{name} is explicit and says nothing of its stability: give its class "
        "stability_limit, the largest stable step times ω of an undamped oscillation"
    )
    theory = limit / 2 * unit
    # the bisection stops at 0.5 %, and a growth that slow is seen from half that beyond the limit
    assert measured_limit(explicit_schemes()[name], model, unit) == pytest.approx(theory, rel=8e-3)
    assert stays_small(explicit_schemes()[name], model, 0.98 * theory)
    assert not stays_small(explicit_schemes()[name], model, 1.02 * theory)


def test_schemes_estimate_their_limit_on_the_safe_side(reduced):
    ratio = reduced["estimated_limit"] / reduced["measured_limit"]
    assert (ratio <= 1).all()
    assert (ratio > 0.5).all()  # or twice the work is done for nothing


# The command


@pytest.fixture
def survey_of(monkeypatch):
    """Put a ready map in place of a survey; give what was asked for."""

    def put(dataset):
        asked = {}

        def ready(scenario, *, progress, **options):
            progress(StudyProgress("alpha = 0", 0, 1))
            asked.update(options, icosphere=scenario.mesh.icosphere)
            return dataset

        monkeypatch.setattr(command, "survey", ready)
        return asked

    return put


@pytest.fixture
def without_defects(reduced):
    fine = reduced.copy(deep=True)
    fine["outcome"][:] = np.minimum(fine["outcome"], Outcome.ERROR)
    return fine


def test_the_command_writes_a_map_and_a_picture(cli, tmp_path, survey_of, without_defects):
    asked = survey_of(without_defects)
    said = cli(
        "extremes", "sphere-lung", "--set", "mesh.icosphere=2", "--reduced", "--limit", "3 s"
    )
    assert (said.code, said.error) == (0, "")
    assert asked == {"reduced": True, "seconds": 3.0, "icosphere": 2}
    assert {path.name for path in tmp_path.iterdir()} == {"extremes.nc", "extremes.png"}
    assert "wrote extremes.nc and extremes.png" in said.out
    xr.testing.assert_identical(xr.load_dataset("extremes.nc"), without_defects)
    counts = [str(int((without_defects["outcome"] == outcome).sum())) for outcome in Outcome]
    assert "all │ " + " │ ".join(counts) in re.sub(" +", " ", said.out)


def test_the_command_names_every_defect_and_fails(cli, survey_of, without_defects):
    worse = without_defects.copy(deep=True)
    worse["outcome"][0, 1] = Outcome.DEFECT
    worse["message"] = worse["message"].astype(object)
    worse["message"][0, 1] = "it sings"
    survey_of(worse)
    said = cli("extremes", "sphere-lung", "-o", "mine.nc", "--no-plot")
    assert said.code == 3
    scheme = worse["integrator"][1].item()
    assert f"defect: alpha = 0, {scheme}: it sings" in said.out
    assert "1 trial ends in a defect; mine.nc says how" in said.error
    assert (xr.load_dataset("mine.nc")["outcome"] == worse["outcome"]).all()


@pytest.mark.parametrize(
    ("option", "said"),
    [
        (("--limit", "3"), "--limit"),
        (("-o", "map.csv"), "ends in .nc"),
        (("--set", "mesh.icosphere=99"), "mesh"),
    ],
)
def test_a_bad_option_is_named(cli, option, said):
    answer = cli("extremes", "sphere-lung", *option)
    assert answer.code == 2
    assert said in answer.error


def test_a_scene_with_obstacles_is_refused():
    with pytest.raises(scenarios.ScenarioError, match="glass has obstacles"):
        Case.of(scenarios.load("glass"))
