"""One value of a table: a number with its unit, a list of such numbers, a choice, or as it is."""

from __future__ import annotations

from types import NoneType
from typing import Any, Literal, get_args, get_origin

import msgspec

from cosim import UnitError, quantity
from scenarios.errors import ScenarioError
from scenarios.scene.tables import choose
from softbody_core import ParameterError
from softbody_core.ground.parameters import Quantity


def read_value(value: Any, kind: Any, expected: Quantity | None, path: str, *, si: bool) -> Any:
    """Read a value.

    Parameters
    ----------
    value : object
        As TOML has it.
    kind : type
        Of the result.
    expected : Quantity or None
        Its unit and bounds. What has a unit arrives in SI units.
    path : str
        Where it stands, for messages.
    si : bool
        Whether a number may stand for text with a unit; it is in SI units then.

    Raises
    ------
    ScenarioError
        If the value does not fit.
    """
    kind = _given(kind)
    if get_origin(kind) is Literal:
        return choose(value, {name: name for name in get_args(kind)}, path)
    if expected is None:
        return _plain(value, kind, path)
    if get_origin(kind) is tuple:
        return _vector(value, kind, expected, path, si=si)
    if expected.unit == "1":
        number = _plain(value, kind, path)
    elif si and isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value)
    else:
        number = _physical(value, expected.unit, path)
    try:
        expected.check(path, number)
    except ParameterError as error:
        raise ScenarioError(str(error)) from error
    return number


def _given(kind: Any) -> Any:
    """Type of a value that is there, where a field may also be None."""
    kinds = [one for one in get_args(kind) if one is not NoneType]
    return kinds[0] if len(kinds) == 1 and NoneType in get_args(kind) else kind


def _vector(
    values: Any, kind: Any, expected: Quantity, path: str, *, si: bool
) -> tuple[float | int, ...]:
    kinds = get_args(kind)
    several = kinds[-1] is Ellipsis
    if not isinstance(values, list) or not (several or len(values) == len(kinds)):
        count = "" if several else f" of {len(kinds)}"
        raise ScenarioError(
            f'{path} = {values!r}: expected a list{count}, each like "1 {expected.unit}"'
        )
    if several:
        kinds = kinds[:1] * len(values)
    return tuple(
        read_value(value, kind, expected, f"{path}[{index}]", si=si)
        for index, (value, kind) in enumerate(zip(values, kinds, strict=True))
    )


def _physical(value: Any, unit: str, path: str) -> float:
    if not isinstance(value, str):
        raise ScenarioError(f'{path} = {value!r} has no unit; write it like "{value} {unit}"')
    try:
        return quantity(value, unit)
    except UnitError as error:
        raise ScenarioError(f"{path}: {error}") from error


def _plain(value: Any, kind: Any, path: str) -> Any:
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise ScenarioError(f"{path} = {value!r}: {_in_words(str(error))}") from error


def _in_words(message: str) -> str:
    """What msgspec says, without the names of Python's types."""
    for jargon, words in (
        (" | null", ""),
        ("`float`", "a number"),
        ("`int`", "a whole number"),
        ("`bool`", "true or false"),
        ("`str`", "text"),
        ("Expected", "expected"),
    ):
        message = message.replace(jargon, words)
    return message.partition(", got ")[0]  # the value itself is shown
