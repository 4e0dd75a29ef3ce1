"""From plain TOML tables to parameter classes, with units and the path of whatever is wrong."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import msgspec

from cosim import UnitError, quantity
from cosim.errors import nearest
from scenarios.errors import ScenarioError
from softbody_core import ParameterError, SimulationError
from softbody_core.ground.parameters import Quantity, quantities_of

T = TypeVar("T")


def table(value: object, path: str) -> dict[str, Any]:
    """Return `value` if it is a table."""
    if not isinstance(value, dict):
        raise ScenarioError(f"{path} = {value!r}: expected a table")
    return value


def choose(name: object, choices: Mapping[str, T], path: str) -> T:
    """Pick from a table of names."""
    if not isinstance(name, str) or name not in choices:
        raise ScenarioError(f"{path} = {name!r}: {nearest(str(name), choices)}")
    return choices[name]


def refuse_unknown(data: Mapping[str, Any], known: list[str], path: str) -> None:
    """Raise for the first key that is not among the known ones."""
    for key in data:
        if key not in known:
            raise ScenarioError(f"{path}.{key}".lstrip(".") + f" is unknown; {nearest(key, known)}")


def decode(kind: type[T], data: object, path: str) -> T:
    """Make a parameter class of a table.

    Numbers that have a unit are written as text, "375 N/m", and arrive in SI units.

    Parameters
    ----------
    kind : type
        A dataclass.
    data : object
        The table.
    path : str
        Where it stands, for messages.

    Raises
    ------
    ScenarioError
        If a key is unknown or missing, or a value does not fit.
    """
    values = table(data, path)
    fields = {field.name: field for field in dataclasses.fields(kind)}  # type: ignore[arg-type]
    refuse_unknown(values, list(fields), path)
    for name, field in fields.items():
        required = (
            field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        )
        if required and name not in values:
            raise ScenarioError(f"{path}.{name} is missing; expected {_expected(kind, name)}")
    hints = get_type_hints(kind)
    decoded = {
        name: _value(value, hints[name], quantities_of(kind).get(name), f"{path}.{name}")
        for name, value in values.items()
    }
    try:
        return kind(**decoded)
    except SimulationError as error:
        raise ScenarioError(f"{path}: {error}") from error


def _value(value: Any, hint: Any, expected: Quantity | None, path: str) -> Any:
    if dataclasses.is_dataclass(value):  # decoded already
        return value
    if expected is not None and get_origin(hint) is tuple:
        return _vector(value, hint, expected, path)
    if get_origin(hint) is Literal:
        return choose(value, {name: name for name in get_args(hint)}, path)
    if expected is not None and expected.unit != "1":
        decoded: Any = _physical(value, expected.unit, path)
    else:
        try:
            decoded = msgspec.convert(value, hint)
        except msgspec.ValidationError as error:
            said = _in_words(str(error))
            raise ScenarioError(f"{path} = {value!r}: {said}") from error
    if expected is not None:
        try:
            expected.check(path, decoded)
        except ParameterError as error:
            raise ScenarioError(str(error)) from error
    return decoded


def _vector(value: Any, hint: Any, expected: Quantity, path: str) -> tuple[Any, ...]:
    kinds = get_args(hint)
    several = kinds[-1] is Ellipsis
    if not isinstance(value, list) or not (several or len(value) == len(kinds)):
        count = "" if several else f" of {len(kinds)}"
        raise ScenarioError(
            f'{path} = {value!r}: expected a list{count}, each like "1 {expected.unit}"'
        )
    if several:
        kinds = kinds[:1] * len(value)
    return tuple(
        _value(part, kind, expected, f"{path}[{index}]")
        for index, (part, kind) in enumerate(zip(value, kinds, strict=True))
    )


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


def _physical(value: Any, unit: str, path: str) -> float:
    if not isinstance(value, str):
        raise ScenarioError(f'{path} = {value!r} has no unit; write it like "{value} {unit}"')
    try:
        return quantity(value, unit)
    except UnitError as error:
        raise ScenarioError(f"{path}: {error}") from error


def _expected(kind: type[Any], name: str) -> str:
    quantity_ = quantities_of(kind).get(name)
    if quantity_ is not None:
        return "a number" if quantity_.unit == "1" else f'text like "1 {quantity_.unit}"'
    return str(get_type_hints(kind)[name])
