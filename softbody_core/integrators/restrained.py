"""Any scheme with restraints: forces move the body freely, then each restraint corrects it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import cast

from softbody_core.constraints import Restraint
from softbody_core.ground.errors import ParameterError
from softbody_core.integrators.integrator import Integrator, Stepper
from softbody_core.model import SoftBodyModel
from softbody_core.state import Inputs, State


class RestrainedStepper(Stepper):
    """Divides a communication step as the restraints ask for, and corrects each part of it.

    This splitting is of first order, whatever the scheme, as long as a restraint acts.

    Parameters
    ----------
    stepper : Stepper
        What moves the body under its forces.
    restraints : sequence of Restraint
        What corrects it, in this order.
    """

    def __init__(self, stepper: Stepper, restraints: Sequence[Restraint]) -> None:
        self._stepper = stepper
        self._restraints = restraints
        self.work = stepper.work

    def advance(self, state: State, inputs: Inputs, dt: float) -> State:
        end, remaining = state.time + dt, 1.0
        while remaining > 0:
            ahead = remaining * dt
            longest = min(restraint.longest_step(state, ahead) for restraint in self._restraints)
            parts = max(1, math.ceil(ahead / longest * (1 - 1e-12)))
            after = self._stepper.advance(state, inputs, ahead / parts)
            for restraint in self._restraints:
                after = restraint.enforce(state, after)
            state = after
            remaining = 0.0 if parts == 1 else remaining * (1 - 1 / parts)
        return replace(state, time=end)

    def memory(self) -> object:
        return self._stepper.memory(), tuple(one.memory() for one in self._restraints)

    def recall(self, memory: object) -> None:
        inner, restraints = cast("tuple[object, tuple[object, ...]]", memory)
        self._stepper.recall(inner)
        for restraint, remembered in zip(self._restraints, restraints, strict=True):
            restraint.recall(remembered)


def bind(integrator: Integrator, model: SoftBodyModel) -> Stepper:
    """Prepare a scheme for a model, with the model's restraints if it has any.

    Raises
    ------
    ParameterError
        If the scheme neglects inertia: what a wall does to a body is an impulse.
    """
    stepper = integrator.bind(model)
    if not model.restraints:
        return stepper
    if integrator.order is None:
        raise ParameterError(
            f"{type(integrator).__name__} neglects inertia, and so cannot keep a body from passing "
            "an obstacle or a largest volume; take any other integrator, such as sdirk2"
        )
    return RestrainedStepper(stepper, model.restraints)
