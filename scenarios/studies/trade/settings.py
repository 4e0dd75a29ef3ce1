"""Settings of a trade: values of axes, from the command line into scenarios and back into words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from cosim import UnitError
from scenarios.errors import ScenarioError
from scenarios.scene.scenario import Draft, Scenario
from scenarios.scene.tables import choose
from scenarios.studies.trade.axes import AXES, Value


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
    values_of: dict[str, tuple[Value, ...]] = {}
    for name, wanted in given.items():
        axis = choose(name, AXES, "axis")
        values = tuple(axis.default(scenario.draft) if wanted is None else wanted)
        if not values or len(set(values)) < len(values):
            raise ScenarioError(f"axis {name} = {list(values)}: expected values, each one once")
        values_of[name] = axis.ordered(values)
    return values_of


def finest(values: Mapping[str, Sequence[Value]]) -> dict[str, Value]:
    """Where in a grid its reference stands: the finest mesh and coupling, without a lag."""
    setting: dict[str, Value] = {}
    for name, choices in values.items():
        pick = AXES[name].finest
        if pick is not None:
            setting[name] = pick(choices)
    return setting


def put_all(scenario: Scenario, setting: Mapping[str, Value]) -> Scenario | None:
    """Build the scenario with a value of each axis in place; None where one means nothing."""
    draft: Draft | None = scenario.draft
    for name, axis in AXES.items():
        if name in setting and draft is not None:
            draft = axis.put(draft, setting[name])
    if draft is None or draft.tables is scenario.tables:
        return None if draft is None else scenario
    return draft.build(si=True)


def in_words(setting: Mapping[str, Value]) -> str:
    """Write a setting in words."""
    return ", ".join(f"{name} {value_text(value)}" for name, value in setting.items())


def value_text(value: Value) -> str:
    """Write a value: as a fraction where that is shorter, 1/30 and not 0.0333333."""
    text = f"{value:g}" if not isinstance(value, str) else value
    if len(text) > 6 and not isinstance(value, str) and 0 < value < 1:
        parts = round(1 / value)
        return f"1/{parts}" if math.isclose(parts * value, 1, rel_tol=1e-9) else text
    return text
