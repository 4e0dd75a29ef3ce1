"""The map: every case under every integrator, as a dataset."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr

from scenarios.running.progress import StudyProgress, Watch, unwatched
from scenarios.scene.scenario import Scenario
from scenarios.studies.extremes.axes import AXES
from scenarios.studies.extremes.cases import Case
from scenarios.studies.extremes.limits import stability_limits
from scenarios.studies.extremes.trial import Trial, try_case
from scenarios.studies.extremes.verdict import Outcome, Reference, Verdict, judge, refer
from softbody_core import INTEGRATORS
from softbody_core.ground.parameters import quantities_of
from softbody_core.integrators import Integrator

_WORK_LIMITS: Final = {"max_substeps": 2_000, "max_steps": 1_000}
"""Where a scheme has such a limit: less than its default, since the map has many trials."""


class Row(NamedTuple):
    """One case under every integrator."""

    axis: str
    setting: str
    value: float
    reference: Reference
    trials: list[Trial]
    verdicts: list[Verdict]


def survey(
    scenario: Scenario,
    *,
    reduced: bool = False,
    seconds: float = 20.0,
    progress: Watch | None = None,
) -> xr.Dataset:
    """Map what happens at the extremes.

    Parameters
    ----------
    scenario : Scenario
        Whose body is taken to its extremes; its controller and its integrator are left out.
    reduced : bool
        Take a few values of each axis.
    seconds : float
        Wall time that one trial may take, s; a run for the reference may take a quarter of it.
    progress : callable, optional
        Called before each case.

    Returns
    -------
    xarray.Dataset
        See ``docs/extremes.md``.

    Raises
    ------
    ScenarioError
        If the scenario's own body cannot be made.
    """
    watch = progress or unwatched
    base = Case.of(scenario)
    schemes = {name: within_limits(kind) for name, kind in INTEGRATORS.items()}
    rows = []
    settings = [
        (name, value)
        for name, axis in AXES.items()
        for value in (axis.few if reduced else axis.values)
    ]
    for index, (name, value) in enumerate(settings):
        watch(StudyProgress(f"{name} = {label(value)}", index, len(settings)))
        rows.append(_row(base, name, value, schemes, seconds))
    dataset = _dataset(rows, list(schemes))
    dataset = dataset.merge(stability_limits(base, reduced=reduced))
    dataset.attrs = {
        "title": f"Extremes of {scenario.title}",
        "scenario_name": scenario.name,
        "scenario": scenario.text,
        "seconds_for_a_trial": seconds,
    }
    return dataset


def within_limits(kind: type[Integrator]) -> Integrator:
    """Make a scheme, with the work limits that it knows set as the map wants them."""
    known = quantities_of(kind)
    return kind(**{name: value for name, value in _WORK_LIMITS.items() if name in known})


def label(value: float | str) -> str:
    """Write a value of an axis."""
    return (
        value if isinstance(value, str) else f"{value:g}".replace("e+0", "e").replace("e-0", "e-")
    )


def _row(
    base: Case, name: str, value: float | str, schemes: dict[str, Integrator], seconds: float
) -> Row:
    try:
        case = AXES[name].change(base, value)
    except Exception as error:  # no body could be made; the verdict names why
        trials = [Trial(error)] * len(schemes)
        reference = Reference(None, "there is no body")
    else:
        trials = [try_case(case, scheme, seconds) for scheme in schemes.values()]
        reference = Reference(None, "no trial comes to an end")
        if any(trial.failure is None for trial in trials):
            reference = refer(case, seconds / 4)
    verdicts = [judge(trial, reference) for trial in trials]
    number = math.nan if isinstance(value, str) else float(value)
    return Row(name, label(value), number, reference, trials, verdicts)


def _dataset(rows: list[Row], schemes: list[str]) -> xr.Dataset:
    both = ("case", "integrator")

    def of_trials(name: str, **attributes: object) -> tuple[Any, ...]:
        return both, np.array([[getattr(t, name) for t in row.trials] for row in rows]), attributes

    def of_verdicts(name: str, **attributes: object) -> tuple[Any, ...]:
        return (
            both,
            np.array([[getattr(v, name) for v in row.verdicts] for row in rows]),
            attributes,
        )

    dimensions, outcomes, attributes = of_verdicts(
        "outcome",
        long_name="how the trial ended",
        flag_values=np.array(list(Outcome), dtype=np.int8),
        flag_meanings=" ".join(outcome.name.lower() for outcome in Outcome),
    )
    return xr.Dataset(
        {
            "outcome": (dimensions, outcomes.astype(np.int8), attributes),
            "message": of_verdicts("message", long_name="reason"),
            "difference": of_verdicts(
                "difference",
                units="1",
                long_name="difference from the reference, of the volume or in radii",
            ),
            "volume_ratio": of_trials(
                "volume_ratio", units="1", long_name="volume reached over rest volume"
            ),
            "inner_steps": of_trials(
                "inner_steps", units="1", long_name="internal steps of the integrator"
            ),
            "warning": (
                ("case", "integrator"),
                [["; ".join(trial.warned) for trial in row.trials] for row in rows],
                {"long_name": "what Python warned of"},
            ),
            "wall_time": of_trials("wall_time", units="s", long_name="computing time"),
            "reference": (
                "case",
                [row.reference.how_known for row in rows],
                {"long_name": "how well the reference is known"},
            ),
        },
        coords={
            "axis": ("case", [row.axis for row in rows], {"long_name": "what is changed"}),
            "setting": ("case", [row.setting for row in rows], {"long_name": "its value"}),
            "value": (
                "case",
                [row.value for row in rows],
                {"long_name": "its value as a number", "comment": "in the unit of its axis"},
            ),
            "unit": ("case", [AXES[row.axis].unit for row in rows], {"long_name": "its unit"}),
            "integrator": schemes,
        },
    )
