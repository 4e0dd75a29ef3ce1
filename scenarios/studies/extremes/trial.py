"""One trial: a case under one integrator, for a limited time."""

from __future__ import annotations

import math
import time as clock
import warnings
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.studies.extremes.cases import STEPS, Case
from softbody_core import Observation, SoftBody, SoftBodyModel, State
from softbody_core.configuration import Configuration
from softbody_core.integrators import Integrator

Floats = NDArray[np.float64]


class OverTime(Exception):
    """A trial went on for longer than it may."""


@dataclass(frozen=True, eq=False)
class Trial:
    """What came of a trial.

    Attributes
    ----------
    failure : Exception or None
        What ended it early, or kept it from starting.
    state_kept : bool
        Whether a body that failed stands where it stood before the step, to the bit.
    finite : bool
        Whether everything that can be seen of the body is finite.
    volume_ratio : float
        Volume reached, over that at rest; NaN if there never was a body.
    points : ndarray, shape (n, 3)
        Positions reached, about the centre of the rest shape, over its radius.
    inner_steps : int
        Internal steps of the integrator.
    wall_time : float
        s.
    warned : tuple of str
        What Python warned of meanwhile, each once.
    """

    failure: Exception | None
    state_kept: bool = True
    finite: bool = True
    volume_ratio: float = math.nan
    points: Floats = field(default_factory=lambda: np.empty((0, 3)))
    inner_steps: int = 0
    wall_time: float = 0.0
    warned: tuple[str, ...] = ()


class _WatchedModel(SoftBodyModel):
    """A model that ends a trial at the first force that is asked for after the deadline."""

    deadline = math.inf

    def force(self, *arguments: Any, **named: Any) -> Floats:
        if clock.perf_counter() > self.deadline:
            raise OverTime("it takes too long")
        return super().force(*arguments, **named)


def try_case(case: Case, integrator: Integrator, seconds: float) -> Trial:
    """Run a case for its communication steps.

    The time limit is looked at whenever a force is evaluated and at the end. So it ends any loop of
    an integrator that evaluates forces; one that hangs without doing so hangs the map too.

    Parameters
    ----------
    case : Case
        Body and drive.
    integrator : Integrator
        Scheme.
    seconds : float
        Wall time that the trial may take, s.
    """
    started = clock.perf_counter()
    body: SoftBody | None = None
    before: State | None = None
    observation: Observation | None = None
    failure: Exception | None = None
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            body = _body(case, integrator, started + seconds)
            for _ in range(STEPS):
                before = _copied(body.state)
                observation = body.step(case.dt, case.inputs.delta_p, case.inputs.n)
        except Exception as error:  # whatever it is, the verdict names it
            failure = error
    wall_time = clock.perf_counter() - started
    if failure is None and wall_time > seconds:
        failure = OverTime("it took too long")
    if body is None:
        return Trial(failure, wall_time=wall_time)
    state = body.state
    finite = np.isfinite(state.positions).all() and np.isfinite(state.velocities).all()
    if observation is not None:
        numbers = (
            observation.time,
            observation.volume,
            observation.pressure,
            observation.flow,
            observation.alveolar_pressure,
        )
        finite &= np.isfinite(numbers).all()
    return Trial(
        failure,
        state_kept=failure is None or before is None or _same(state, before),
        finite=bool(finite),
        volume_ratio=Configuration(case.mesh, state.positions).volume / case.mesh.volume,
        points=(body.positions - case.mesh.points.mean(axis=0)) / case.radius,
        inner_steps=body.counters.steps,
        wall_time=wall_time,
        warned=tuple(dict.fromkeys(str(warning.message) for warning in warned)),
    )


def _body(case: Case, integrator: Integrator, deadline: float) -> SoftBody:
    model = _WatchedModel(case.mesh, case.mass, case.forces, case.weights, case.constraints)
    model.deadline = deadline
    body = SoftBody(model, integrator)
    if case.start is not None:
        start = np.ascontiguousarray(case.start.T)
        body.state = State(0.0, start, np.zeros_like(start))
    return body


def _copied(state: State) -> State:
    return State(state.time, state.positions.copy(), state.velocities.copy())


def _same(state: State, other: State) -> bool:
    return (
        state.time == other.time
        and np.array_equal(state.positions, other.positions)
        and np.array_equal(state.velocities, other.velocities)
    )
