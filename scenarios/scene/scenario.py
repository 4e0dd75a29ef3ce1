"""A scenario: everything that decides a result, as plain tables and as what they say."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from scenarios.errors import ScenarioError
from scenarios.scene.bodies import members
from scenarios.scene.controller import Controller
from scenarios.scene.decode import Decoder
from scenarios.scene.layout import parts_of, places_of
from scenarios.scene.rules import check_rules
from scenarios.scene.schema import Scene
from scenarios.scene.tables import with_values
from scenarios.scene.text import toml

_TABLES: Final = [place.key for place in places_of(Scene).values() if place.name != "title"]
"""Tables that a scenario may have."""


@dataclass(frozen=True)
class Draft:
    """A scenario before it is built: its tables, which may still be wrong.

    Attributes
    ----------
    name : str
        For messages and datasets.
    folder : Path
        Against which relative paths in it are read.
    tables : mapping
        As TOML has them, without the variants.
    source : str or None
        The text that they were read from, as long as nothing is changed.
    """

    name: str
    folder: Path
    tables: Mapping[str, Any]
    source: str | None = None

    @property
    def title(self) -> str:
        """Its title, or its name if it has none."""
        return str(self.tables.get("title", self.name))

    def changed(self, changes: Mapping[str, Any]) -> Draft:
        """Return the draft with values put in place, by dotted path."""
        if not changes:
            return self
        return dataclasses.replace(self, tables=with_values(self.tables, changes), source=None)

    def with_controller(self, controller: str | Path) -> Draft:
        """Return the draft with another controller, and the parameters it holds for that one.

        Raises
        ------
        ScenarioError
            If nothing drives the scenario, but inputs that are held.
        """
        if "controller" not in self.tables:
            raise ScenarioError(
                f"scenario {self.name} has no controller to replace: its inputs are held (table "
                "[inputs]); give it a table [controller] instead"
            )
        use = str(controller)
        if Controller(use).is_file:
            use = str(Path(use).resolve())
        return self.changed({"controller.use": use})

    def read(self, name: str) -> Any:
        """Read one field of `Scene` alone; of several bodies, that of the first one."""
        tables = self.tables
        if "bodies" in tables:
            tables = next(iter(members(tables, _TABLES).values()))
        place = places_of(Scene)[name]
        return Decoder(si=True).read(place, {place.key: {}, **tables}, "")

    def build(self, *, si: bool = False) -> Scenario:
        """Make the scenario.

        Parameters
        ----------
        si : bool
            Whether a number may stand for text with a unit; it is in SI units then.

        Raises
        ------
        ScenarioError
            With the path of the first thing that is wrong.
        """
        if "bodies" not in self.tables:
            return self._build(Decoder(si))
        bodies = {}
        for name, tables in members(self.tables, _TABLES).items():
            try:
                bodies[name] = dataclasses.replace(self, tables=tables, source=None).build(si=si)
            except ScenarioError as error:
                raise ScenarioError(f"bodies.{name}: {error}") from error
        first = next(iter(bodies.values()))
        return dataclasses.replace(first, tables=self.tables, source=self.source, bodies=bodies)

    def _build(self, decoder: Decoder) -> Scenario:
        tables = {**self.tables, "title": self.title}
        scene = decoder.decode(Scene, tables, "")
        check_rules(scene, tables)
        values = {name: getattr(scene, name) for name in places_of(Scene)}
        return Scenario(
            **values, name=self.name, folder=self.folder, tables=self.tables, source=self.source
        )


@dataclass(frozen=True, kw_only=True)
class Scenario(Scene):
    """Everything that decides a result. Read one with `scenarios.load`.

    Attributes
    ----------
    title, mesh, body, weights, forces, constraints, obstacles, contact, controller, inputs, \
    integrator, coupling, run
        As of `Scene`; where there are several bodies, of the first one.
    name : str
        Short.
    folder : Path
        Against which relative paths in it are read.
    tables : mapping
        What it was built from.
    source : str or None
        The text that these were read from, as long as nothing is changed.
    bodies : mapping
        Where there are several: each as a scenario of its own, by name.
    """

    name: str
    folder: Path
    tables: Mapping[str, Any] = field(compare=False, repr=False)
    source: str | None = field(default=None, compare=False, repr=False)
    bodies: Mapping[str, Scenario] = field(default_factory=dict)

    @property
    def draft(self) -> Draft:
        """Its tables, to be changed."""
        return Draft(self.name, self.folder, self.tables, self.source)

    def changed(self, changes: Mapping[str, Any]) -> Scenario:
        """Return this scenario with values replaced.

        Parameters
        ----------
        changes : mapping
            By dotted path: ``{"coupling.step": 0.01, "body.mass": "400 g"}``. A number that has a
            unit is in SI units, or text with a unit. A table takes the place of a whole table.

        Raises
        ------
        ScenarioError
            With the path of the first thing that is wrong.
        """
        return self.draft.changed(changes).build(si=True)

    @property
    def text(self) -> str:
        """The scenario as TOML; loading it again gives an equal scenario."""
        return toml(self.tables, self._kinds()) if self.source is None else self.source

    def text_with(self, changes: Mapping[str, Any]) -> str:
        """The text, with values replaced; they are not looked at before the text is read."""
        if not changes:
            return self.text
        return toml(with_values(self.tables, changes), self._kinds())

    @property
    def portable_text(self) -> str:
        """The text, with paths that hold wherever it is saved."""
        return self.text_with(dict(self._files()))

    def parts(self) -> Iterator[tuple[str, Any]]:
        """Every object that was made of a table, after the path of the table."""
        yield from parts_of(self, "")
        for name, body in self.bodies.items():
            for path, part in body.parts():
                yield from ((path, part), (f"bodies.{name}.{path}", part))

    def _kinds(self) -> Iterator[tuple[str, type[Any]]]:
        return ((path, type(part)) for path, part in self.parts())

    def _files(self) -> Iterator[tuple[str, str]]:
        """Files that it names, after the path of the name; absolute."""
        bodies = {f"bodies.{name}.": body for name, body in self.bodies.items()} or {"": self}
        for path, body in bodies.items():
            if body.mesh.file is not None:
                yield f"{path}mesh.file", str(self.folder / body.mesh.file)
        for obstacle in self.obstacles:
            if obstacle.mesh.file is not None:
                yield (
                    f"obstacles.{obstacle.name}.mesh.file",
                    str(self.folder / obstacle.mesh.file),
                )
        if self.controller is not None and self.controller.is_file:
            yield "controller.use", str(self.folder / self.controller.use)
