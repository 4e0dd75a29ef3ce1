"""From plain tables to dataclasses of dataclasses, with units, and the path of what is wrong."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from scenarios.errors import ScenarioError
from scenarios.scene.layout import Place, places_of
from scenarios.scene.tables import join, refuse_unknown, table
from scenarios.scene.values import read_value
from softbody_core import SimulationError

T = TypeVar("T")


@dataclass(frozen=True)
class Decoder:
    """Makes dataclasses of tables.

    Attributes
    ----------
    si : bool
        A number without a unit is in the SI unit of its field, as programs write it. In a file that
        is an error: there a number that has a unit is text, "375 N/m".
    """

    si: bool = False

    def decode(self, kind: type[T], data: object, path: str, /, **given: Any) -> T:
        """Make a dataclass of a table.

        Parameters
        ----------
        kind : type
            The dataclass.
        data : object
            The table.
        path : str
            Where it stands, for messages.
        **given
            Values of fields that do not stand in the table.

        Raises
        ------
        ScenarioError
            If a key is unknown or missing, or a value does not fit.
        """
        values = self.values(kind, data, path, given)
        try:
            return kind(**given, **values)
        except SimulationError as error:
            raise ScenarioError(f"{path}: {error}") from error

    def values(
        self, kind: type[Any], data: object, path: str, given: Mapping[str, Any]
    ) -> dict[str, Any]:
        """Read the values of a dataclass's fields, of those that stand in the table."""
        values = table(data, path)
        places = [place for place in places_of(kind).values() if place.name not in given]
        beside = _keys_of_shared_tables(places, values, path)
        refuse_unknown(values, [*(p.key for p in places if p.key), *beside.get("", ())], path)
        for place in places:
            if place.required and place.key and place.key not in values:
                raise ScenarioError(_missing(place, path))
        present = (place for place in places if not place.key or place.key in values)
        return {place.name: self.read(place, values, path) for place in present}

    def read(self, place: Place, owner: Mapping[str, Any], path: str) -> Any:
        """Read the value of one field; `owner` is the table of the dataclass that it belongs to."""
        where = join(path, place.key)
        data = owner[place.key] if place.key else owner
        if place.shared is not None:
            keys = place.keys(data, where)
            data = {key: value for key, value in data.items() if key in keys}
        if place.refusing is not None and place.refusing.key in table(data, where):
            raise ScenarioError(
                f"{where}.{place.refusing.key} is unknown; {place.refusing.instead}"
            )
        if place.form is not None:
            return place.form.read(data, where, self.decode)
        if dataclasses.is_dataclass(place.kind):
            return self.decode(place.kind, data, where)  # type: ignore[arg-type]
        return read_value(data, place.kind, place.quantity, where, si=self.si)


def decode(kind: type[T], data: object, path: str) -> T:
    """Make a dataclass of a table, as a file holds it; see `Decoder.decode`."""
    return Decoder().decode(kind, data, path)


def _keys_of_shared_tables(
    places: Sequence[Place], values: Mapping[str, Any], path: str
) -> dict[str, list[str]]:
    """Keys of each table in which fields stand side by side; unknown ones are refused."""
    known: dict[str, list[str]] = {}
    for place in places:
        if place.shared is not None:
            where = join(path, place.shared)
            inside = values if not place.shared else table(values.get(place.shared, {}), where)
            known.setdefault(place.shared, []).extend(place.keys(inside, where))
    for name, keys in known.items():
        if name:
            refuse_unknown(values.get(name, {}), keys, join(path, name))
    return known


def _missing(place: Place, path: str) -> str:
    if not path:
        return f"table [{place.key}] is missing"
    if place.quantity is not None:
        unit = place.quantity.unit
        expected = "a number" if unit == "1" else f'text like "1 {unit}"'
    elif dataclasses.is_dataclass(place.kind):
        expected = f"a table like [{place.key}]"
    else:
        expected = str(place.kind)
    return f"{path}.{place.key} is missing; expected {expected}"
