"""What a trade can vary: the values of each axis, and how a value goes into a scenario.

A new axis is one line in `AXES`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from cosim import ALGORITHMS, UnitError, quantity
from cosim.algorithms.signals import DEGREES
from scenarios.errors import ScenarioError
from scenarios.scene.scenario import Scenario
from scenarios.scene.tables import choose
from scenarios.studies.trade.schemes import with_inner_step, with_integrator, with_tolerance
from scenarios.studies.trade.sizes import sizes, with_points
from softbody_core import INTEGRATORS

Value = str | float


@dataclass(frozen=True)
class Axis:
    """One thing to vary.

    Attributes
    ----------
    units, long_name : str
        Of its coordinate.
    default : callable
        Its values for a scenario.
    read : callable
        From text to a value; raises `ValueError` or `UnitError`.
    put : callable
        The scenario with a value in place; None where the axis means nothing to the scheme.
    """

    units: str
    long_name: str
    default: Callable[[Scenario], Sequence[Value]]
    read: Callable[[str], Value]
    put: Callable[[Scenario, Any], Scenario | None]


def _with_communication_step(scenario: Scenario, step: float) -> Scenario:
    return scenario.changed({"coupling.step": f"{step!r} s"})


def _with_algorithm(scenario: Scenario, algorithm: str) -> Scenario:
    """Change the algorithm; the options in the scenario stay with the one that they are for."""
    if isinstance(scenario.coupling.algorithm, choose(algorithm, ALGORITHMS, "algorithm")):
        return scenario
    step = f"{scenario.coupling.step!r} s"
    return scenario.changed({"coupling": {"algorithm": algorithm, "step": step}})


AXES: Final[dict[str, Axis]] = {
    "points": Axis("1", "number of points", sizes, int, with_points),
    "communication_step": Axis(
        "s",
        "communication step",
        lambda scenario: [scenario.coupling.step / parts for parts in (1, 2, 4)],
        lambda text: quantity(text, "s"),
        _with_communication_step,
    ),
    "algorithm": Axis("1", "coupling algorithm", lambda _: list(ALGORITHMS), str, _with_algorithm),
    "extrapolation": Axis(
        "1",
        "polynomial by which inputs go on over a communication step",
        lambda _: list(DEGREES),
        str,
        lambda scenario, name: scenario.changed({"coupling.extrapolation": name}),
    ),
    "integrator": Axis("1", "scheme", lambda _: list(INTEGRATORS), str, with_integrator),
    "dt": Axis(
        "1",
        "inner step as a share of the scheme's longest",
        lambda _: [1.0, 0.5, 0.25, 0.125],
        float,
        with_inner_step,
    ),
    "tolerance": Axis("1", "tolerance", lambda _: [1e-2, 1e-3, 1e-4, 1e-5], float, with_tolerance),
}
"""In the order in which they are put into a scenario: `dt` has to know the scheme."""


def read_axes(text: str) -> dict[str, tuple[Value, ...] | None]:
    """Read names of axes with a comma in between, each with its own values if one wants others.

    Parameters
    ----------
    text : str
        Such as ``"integrator,dt"`` or ``"integrator=sdirk2:rk4,dt=1:0.5"``.

    Returns
    -------
    dict
        Values by axis; None for its default ones.

    Raises
    ------
    ScenarioError
        If an axis is unknown or named twice, or a value cannot be read.
    """
    read: dict[str, tuple[Value, ...] | None] = {}
    for part in text.split(","):
        name, equals, values = (piece.strip() for piece in part.partition("="))
        if name in read:
            raise ScenarioError(f"axis {name!r} is named twice")
        axis = choose(name, AXES, "axis")
        try:
            read[name] = tuple(axis.read(v.strip()) for v in values.split(":")) if equals else None
        except (ValueError, UnitError) as error:
            raise ScenarioError(
                f"axis {name} = {values!r} cannot be read: {error}. Values have a colon in between"
            ) from error
    return read


def axis_values(
    scenario: Scenario, axes: Sequence[str] | Mapping[str, Sequence[Value] | None]
) -> dict[str, tuple[Value, ...]]:
    """Values of each axis: those that are given, else its default ones; coarse comes first."""
    given = axes if isinstance(axes, Mapping) else dict.fromkeys(axes)
    if not given:
        raise ScenarioError(f"no axis is named; expected some of {', '.join(AXES)}")
    chosen: dict[str, tuple[Value, ...]] = {}
    for name, own in given.items():
        axis = choose(name, AXES, "axis")
        values = tuple(axis.default(scenario) if own is None else own)
        if not values or len(set(values)) < len(values):
            raise ScenarioError(f"axis {name} = {list(values)}: expected values, each one once")
        numbers = axis.read is not str
        chosen[name] = tuple(sorted(values, reverse=name != "points")) if numbers else values
    return chosen


def finest(values: Mapping[str, Sequence[Value]]) -> dict[str, Value]:
    """Where in a grid its reference stands: the finest mesh and coupling, without a lag."""
    best: dict[str, Callable[[Sequence[Any]], Value]] = {
        "points": max,
        "communication_step": min,
        "algorithm": lambda _: "gauss-seidel",
        "extrapolation": lambda names: max(names, key=DEGREES.__getitem__),
    }
    return {name: best[name](values[name]) for name in values if name in best}


def put_all(scenario: Scenario, setting: Mapping[str, Value]) -> Scenario | None:
    """Return the scenario with a value of each axis in place; None where one means nothing."""
    chosen: Scenario | None = scenario
    for name, axis in AXES.items():
        if name in setting and chosen is not None:
            chosen = axis.put(chosen, setting[name])
    return chosen


def named(setting: Mapping[str, Value]) -> str:
    """Say a setting in words."""
    return ", ".join(f"{name} {told(value)}" for name, value in setting.items())


def told(value: Value) -> str:
    """Text of a value: as a fraction where that is shorter, 1/30 and not 0.0333333."""
    text = f"{value:g}" if not isinstance(value, str) else value
    if len(text) > 6 and not isinstance(value, str) and 0 < value < 1:
        parts = round(1 / value)
        return f"1/{parts}" if math.isclose(parts * value, 1, rel_tol=1e-9) else text
    return text
