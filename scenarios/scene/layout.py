"""How the fields of a dataclass stand in a table.

A field stands under its own name: a value, or a table where it is a dataclass itself. A field that
stands in another way says so in its annotation, by one of the marks below.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Protocol, TypeVar, cast, get_args, get_origin, get_type_hints

from scenarios.errors import ScenarioError
from scenarios.scene.tables import choose, join, refuse_unknown, table
from softbody_core.ground.parameters import Quantity

T = TypeVar("T")


class Decode(Protocol):
    """Makes a dataclass of a table; see `scenarios.scene.decode.Decoder.decode`."""

    def __call__(self, kind: type[Any], data: object, path: str, /, **given: Any) -> Any: ...


class Form(ABC):
    """A field that is neither one value nor one table of its own kind."""

    @abstractmethod
    def read(self, data: Any, path: str, decode: Decode) -> Any:
        """Make the field's value of what stands in its place."""

    def keys(self, data: Mapping[str, Any], path: str) -> Sequence[str]:
        """Keys that the field takes of a table that it shares with others."""
        raise NotImplementedError(f"{type(self).__name__} needs a table of its own")

    @abstractmethod
    def parts(self, value: Any, path: str) -> Iterator[tuple[str, Any]]:
        """Each object in the field's value, after the path of its table."""


@dataclass(frozen=True)
class OneOf(Form):
    """One of several kinds: the table names the kind under `key`, beside the kind's options.

    Attributes
    ----------
    kinds : mapping
        By name.
    key : str
        Under which the name stands.
    default : str
        Kind of an empty table, and where `implied`, of every table that names none.
    implied : bool
        See there.
    """

    kinds: Mapping[str, type[Any]]
    key: str
    default: str
    implied: bool = False

    def read(self, data: Any, path: str, decode: Decode) -> Any:
        """Make an object of the kind that is named."""
        options = dict(table(data, path))
        kind = self._kind(options, path)
        options.pop(self.key, None)
        return decode(kind, options, path)

    def keys(self, data: Mapping[str, Any], path: str) -> Sequence[str]:
        """Key of the name, and the options of the kind that is named."""
        return [self.key, *places_of(self._kind(data, path))]

    def parts(self, value: Any, path: str) -> Iterator[tuple[str, Any]]:
        """The object, and what is in it."""
        return parts_of(value, path)

    def _kind(self, data: Mapping[str, Any], path: str) -> type[Any]:
        default = self.default if self.implied or not data else None
        return choose(data.get(self.key, default), self.kinds, f"{path}.{self.key}")


@dataclass(frozen=True)
class EachOf(Form):
    """Objects of several kinds: a table for each, under the kind's name.

    Attributes
    ----------
    kinds : mapping
        By name.
    lists : bool
        Several objects of a kind may stand there as a list of tables.
    """

    kinds: Mapping[str, type[Any]]
    lists: bool = False

    def read(self, data: Any, path: str, decode: Decode) -> tuple[Any, ...]:
        """Make all of them, in the order of the tables."""
        refuse_unknown(table(data, path), self.kinds, path)
        return tuple(
            decode(self.kinds[name], single, join(path, name))
            for name, value in data.items()
            for single in (value if self.lists and isinstance(value, list) else [value])
        )

    def keys(self, data: Mapping[str, Any], path: str) -> Sequence[str]:
        """Names of the kinds."""
        return list(self.kinds)

    def parts(self, value: Any, path: str) -> Iterator[tuple[str, Any]]:
        """Each object, under the name of its kind."""
        names = {kind: name for name, kind in self.kinds.items()}
        for single in value:
            yield from parts_of(single, join(path, names[type(single)]))


@dataclass(frozen=True)
class ByName(Form):
    """Objects of one kind, each in a table of its own name, which goes into the field `key`."""

    kind: type[Any]
    key: str

    def read(self, data: Any, path: str, decode: Decode) -> tuple[Any, ...]:
        """Make all of them, in the order of the tables."""
        made = []
        for name, value in table(data, path).items():
            where = join(path, name)
            if self.key in table(value, where):
                owner = self.kind.__name__.lower()
                raise ScenarioError(
                    f"{where}.{self.key} is unknown; the table's own name is the {owner}'s"
                )
            made.append(decode(self.kind, value, where, **{self.key: name}))
        return tuple(made)

    def parts(self, value: Any, path: str) -> Iterator[tuple[str, Any]]:
        """Each object, under its name."""
        for single in value:
            yield from parts_of(single, join(path, getattr(single, self.key)))


@dataclass(frozen=True)
class ReadBy(Form):
    """What no other form can say: a function makes the value."""

    function: Callable[[Any, str, Decode], Any]

    def read(self, data: Any, path: str, decode: Decode) -> Any:
        """Call the function."""
        return self.function(data, path, decode)

    def parts(self, value: Any, path: str) -> Iterator[tuple[str, Any]]:
        """What was made, and what is in it."""
        return iter(()) if value is None else parts_of(value, path)


@dataclass(frozen=True)
class In:
    """The field's keys stand in `table`, beside those of others; "" is its owner's own table."""

    table: str


@dataclass(frozen=True)
class Refusing:
    """A field of the object that no file sets, and what to do instead."""

    key: str
    instead: str


@dataclass(frozen=True)
class Place:
    """A field of a dataclass, and how it stands in a table.

    Attributes
    ----------
    name, kind : str, type
        Of the field.
    required : bool
        It has no default.
    quantity, form, refusing
        What its annotation says.
    shared : str or None
        Table in which it stands beside others.
    """

    name: str
    kind: Any
    required: bool
    quantity: Quantity | None
    form: Form | None
    refusing: Refusing | None
    shared: str | None

    @property
    def key(self) -> str:
        """Key of its value, or of the table that it shares; "" for its owner's own table."""
        return self.name if self.shared is None else self.shared

    def keys(self, data: Mapping[str, Any], path: str) -> Sequence[str]:
        """Keys that it takes of a table that it shares."""
        return list(places_of(self.kind)) if self.form is None else self.form.keys(data, path)


def places_of(kind: type[Any]) -> Mapping[str, Place]:
    """Fields of a dataclass, by name."""
    return _places_of(cast("Hashable", kind))


@cache
def _places_of(kind: Hashable) -> Mapping[str, Place]:
    hints = get_type_hints(kind, include_extras=True)
    fields = dataclasses.fields(cast("type[Any]", kind))
    return {field.name: _place(field, hints[field.name]) for field in fields}


def parts_of(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Give an object that was made of a table, and those in it, each after its table's path."""
    yield path, value
    for place in places_of(type(value)).values():
        inside, where = getattr(value, place.name), join(path, place.key)
        if place.form is not None:
            yield from place.form.parts(inside, where)
        elif dataclasses.is_dataclass(place.kind):
            yield from parts_of(inside, where)


def _place(field: dataclasses.Field[Any], hint: Any) -> Place:
    kind, *marks = get_args(hint) if get_origin(hint) is Annotated else (hint,)

    def mark(of: type[T]) -> T | None:
        return next((mark for mark in marks if isinstance(mark, of)), None)

    shared = mark(In)
    return Place(
        field.name,
        kind,
        field.default is field.default_factory is dataclasses.MISSING,
        mark(Quantity),
        mark(Form),  # type: ignore[type-abstract]
        mark(Refusing),
        None if shared is None else shared.table,
    )
