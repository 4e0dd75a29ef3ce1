"""How the fields of a dataclass stand in a table.

A field stands under its own name: a value, or a table where it is a dataclass itself. A field that
stands in another way says so in its annotation: by a `Form`, of which ``forms.py`` has some, by
`In`, or by `Refusing`.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Protocol, TypeVar, cast, get_args, get_origin, get_type_hints

from scenarios.scene.tables import join
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
