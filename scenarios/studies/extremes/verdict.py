"""What a trial is worth: right, bounded, a named error, or a defect."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np

from scenarios.studies.extremes.cases import Case
from scenarios.studies.extremes.trial import OverTime, Trial, try_case
from softbody_core import SDIRK2, SimulationError
from softbody_core.stability import LARGEST_VOLUME_RATIO

RIGHT_WITHIN: Final = 0.01
"""Difference from the reference, of the volume or in radii, up to which a trial is right."""

RUNAWAY: Final = 10.0
"""Volume over that of the reference, or the other way round, from which a trial is a defect."""

_TOLERANCES: Final = (1e-4, 1e-5)


class Outcome(IntEnum):
    """How a trial ends; all but the last are as it should be."""

    RIGHT = 0
    BOUNDED = 1
    ERROR = 2
    DEFECT = 3


@dataclass(frozen=True, eq=False)
class Reference:
    """What a case should come to, where that is known.

    Attributes
    ----------
    trial : Trial or None
        The same case, computed more tightly; None where that fails.
    how_known : str
        How well it is known, or why it is not.
    """

    trial: Trial | None
    how_known: str


@dataclass(frozen=True)
class Verdict:
    """An outcome with its reason, and the difference from the reference (NaN without one)."""

    outcome: Outcome
    message: str
    difference: float = math.nan


def refer(case: Case, seconds: float) -> Reference:
    """Find what a case should come to.

    The case is run at the origin in its own units of mass, length and time, by SDIRK2 at two tight
    tolerances; the reference is known where the two agree to half of `RIGHT_WITHIN`. So whatever
    agrees with it is also right about units and about the place where the body stands.
    """
    try:
        scaled = case.in_own_units()
    except SimulationError as error:
        return Reference(None, named(error))
    runs: list[Trial] = []
    for tolerance in _TOLERANCES:
        runs.append(try_case(scaled, SDIRK2(tolerance=tolerance, max_iterations=50), seconds))
        if (failure := runs[-1].failure) is not None:
            return Reference(None, f"at tolerance {tolerance:g}, {named(failure)}")
    spread = difference(*runs)
    if not spread <= RIGHT_WITHIN / 2:
        return Reference(None, f"two tight runs differ by {spread:.2g}")
    return Reference(runs[-1], f"two tight runs agree to {spread:.2g}")


def difference(trial: Trial, other: Trial) -> float:
    """Larger one of the relative difference of volume and the rms distance of points, in radii."""
    with np.errstate(over="ignore"):
        apart = float(np.sqrt(np.mean(np.sum((trial.points - other.points) ** 2, axis=1))))
    return max(abs(trial.volume_ratio / other.volume_ratio - 1), apart)


def judge(trial: Trial, reference: Reference) -> Verdict:
    """Give the verdict on a trial.

    Parameters
    ----------
    trial : Trial
        What was done.
    reference : Reference
        What should have come of it.
    """
    failure = trial.failure
    if isinstance(failure, OverTime):
        return Verdict(Outcome.DEFECT, f"over time: still at work after {trial.wall_time:.1f} s")
    if failure is not None and not isinstance(failure, SimulationError):
        return Verdict(Outcome.DEFECT, f"not an error of this project: {named(failure)}")
    if not trial.finite:
        return Verdict(Outcome.DEFECT, "the body is left with numbers that are not finite")
    if failure is not None:
        if not trial.state_kept:
            return Verdict(Outcome.DEFECT, f"the last good state is lost after {named(failure)}")
        return Verdict(Outcome.ERROR, named(failure))
    ratio = trial.volume_ratio
    if not 0 < ratio <= LARGEST_VOLUME_RATIO:
        return Verdict(Outcome.DEFECT, f"silent runaway: the volume is {ratio:.3g} times its rest")
    if reference.trial is None:
        message = f"{ratio:.4g} V0, with nothing to compare it to: {reference.how_known}"
        return Verdict(Outcome.BOUNDED, message)
    right, apart = reference.trial.volume_ratio, difference(trial, reference.trial)
    if apart <= RIGHT_WITHIN:
        return Verdict(Outcome.RIGHT, f"within {apart:.1g} of the reference", apart)
    message = f"{ratio:.4g} V0 where the reference has {right:.4g}; off by {apart:.2g}"
    if not 1 / RUNAWAY < ratio / right < RUNAWAY:
        return Verdict(Outcome.DEFECT, f"silent runaway: {message}", apart)
    return Verdict(Outcome.BOUNDED, message, apart)


def named(error: Exception) -> str:
    """Name an error, and what it says."""
    return f"{type(error).__name__}: {error}"
