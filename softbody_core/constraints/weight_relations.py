"""Relations among the weights α, β, γ, δ.

"Constraints may exist for relations among these components" (Mesit & Guha 2011, section 2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal, get_args

import numpy as np

from softbody_core.constraints.constraint import Constraint
from softbody_core.ground.errors import ParameterError
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.observation import Observation
from softbody_core.weights import Weights

WeightName = Literal["alpha", "beta", "gamma", "delta"]


def _check_name(relation: str, name: str) -> None:
    """Raise `ParameterError` for what is no weight."""
    if name not in get_args(WeightName):
        expected = ", ".join(get_args(WeightName))
        raise ParameterError(f"{relation}: {name!r} is no weight; expected one of {expected}")


@dataclass(frozen=True)
class WeightRatio(Parameters, Constraint):
    """One weight stays in a fixed ratio to another, as the constraints before this one left it.

    Parameters
    ----------
    weight : {"alpha", "beta", "gamma", "delta"}
        The weight that follows.
    to : {"alpha", "beta", "gamma", "delta"}
        The weight that it follows.
    ratio : float
        `weight` over `to`.
    """

    weight: WeightName
    to: WeightName
    ratio: Annotated[float, Quantity("1", at_least=0)]

    def __post_init__(self) -> None:
        """Refuse what is no weight, and a weight that follows itself."""
        super().__post_init__()
        _check_name("WeightRatio", self.weight)
        _check_name("WeightRatio", self.to)
        Weights(**{self.weight: self.ratio})  # which says whether it may be 0
        if self.weight == self.to:
            raise ParameterError(f"WeightRatio: {self.weight} cannot follow itself")

    def related(self, weights: Weights, observation: Observation) -> Weights:
        """Set the weight to the ratio times the other."""
        return replace(weights, **{self.weight: self.ratio * getattr(weights, self.to)})


@dataclass(frozen=True)
class WeightCourse(Parameters, Constraint):
    """One weight follows a course in time, linear between its points and constant beyond them.

    It is read at the start of each communication step and holds over the step.

    Parameters
    ----------
    weight : {"alpha", "beta", "gamma", "delta"}
        The weight.
    times : tuple of float
        Increasing, s.
    values : tuple of float
        The weight at those times.
    """

    weight: WeightName
    times: Annotated[tuple[float, ...], Quantity("s")]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        """Check the course."""
        super().__post_init__()
        _check_name("WeightCourse", self.weight)
        if len(self.times) != len(self.values) or not self.times:
            raise ParameterError(
                f"WeightCourse of {self.weight}: {len(self.times)} times and {len(self.values)} "
                "values; expected as many of each, at least one"
            )
        if not np.isfinite([*self.times, *self.values]).all() or np.any(np.diff(self.times) <= 0):
            raise ParameterError(
                f"WeightCourse of {self.weight}: times = {self.times}: expected increasing, "
                "finite numbers, in seconds"
            )
        for value in self.values:
            Weights(**{self.weight: value})  # which says what is wrong with it

    def related(self, weights: Weights, observation: Observation) -> Weights:
        """Set the weight to its value at the time of the body."""
        value = float(np.interp(observation.time, self.times, self.values))
        return replace(weights, **{self.weight: value})
