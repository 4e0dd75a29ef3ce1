"""Fields that are neither one value nor one table of their own kind."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scenarios.errors import ScenarioError
from scenarios.scene.layout import Decode, Form, parts_of, places_of
from scenarios.scene.tables import choose, join, refuse_unknown, table


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
