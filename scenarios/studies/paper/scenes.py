"""The scenes behind the paper's figures: each is run once, and kept for the next call."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from scenarios.commands.options import chosen
from scenarios.errors import OutputError, RunError, ScenarioError
from scenarios.results.analysis import breaths
from scenarios.results.files import save
from scenarios.running.run import COMPLETED, Progress, run, versions
from scenarios.scene.parse import parse
from scenarios.scene.scenario import Scenario
from softbody_core import SimulationError, Weights

GLASS: Final = {letter: f"glass-{letter.lower()}" for letter in "ABCDEF"}
"""Experiments of Table 1."""
ALPHA: Final = {letter: f"lung-{letter.lower()}" for letter in "ABC"}
"""Experiments of Table 2."""
BETA: Final = {letter: f"lung-beta-{letter.lower()}" for letter in "ABCDE"}
"""Experiments of Table 3."""
THERMOSTAT: Final = "lung-thermostat"
"""Table 2 C with f(P) followed in both phases, for Figure 7."""

STRIDES: Final[dict[str, int]] = {
    **dict.fromkeys(GLASS.values(), 100),
    **dict.fromkeys([*ALPHA.values(), *BETA.values(), THERMOSTAT], 6),
}
"""Communication steps between two snapshots of each scene: whole parts of the paper's frames."""

Datasets = Mapping[str, xr.Dataset]
Tell = Callable[[str, float], None]
"""Is told what goes on, and the share of it that is done."""


@dataclass
class Scenes:
    """Datasets of scenes: kept in a folder, or run.

    Attributes
    ----------
    folder : Path
        Holds NAME.nc of each scene.
    changes : sequence of str
        Assignments ``path=value`` for every scene.
    cycles : str, optional
        Number of breaths of every scene.
    fresh : bool
        Do not take what the folder holds.
    datasets : dict
        What has come of the scenes so far.
    failures : dict
        Why a scene has no dataset here.
    """

    folder: Path
    changes: Sequence[str] = ()
    cycles: str | None = None
    fresh: bool = False
    datasets: dict[str, xr.Dataset] = field(default_factory=dict)
    failures: dict[str, SimulationError] = field(default_factory=dict)

    def path(self, name: str) -> Path:
        """Where a scene's dataset is kept."""
        return self.folder / f"{name}.nc"

    def check(self, names: Sequence[str]) -> None:
        """Raise `ScenarioError` if the changes suit none of the scenes: they are a mistake then."""
        errors = []
        for name in names:
            try:
                self._scenario(name)
            except ScenarioError as error:
                errors.append(error)
        if errors and len(errors) == len(names):
            raise errors[0]

    def look(self, name: str) -> xr.Dataset | None:
        """Return what the folder holds of a scene, if it would come out the same again."""
        if self.fresh or not self.path(name).exists():
            return None
        try:
            return self._kept(name, self._scenario(name))
        except ScenarioError:  # changes that were meant for other scenes
            return None

    def get(self, name: str, tell: Tell) -> xr.Dataset | None:
        """Take a scene from the folder, or run it and keep it; None if it failed.

        Raises
        ------
        RunError
            If the run was interrupted; what was computed is kept.
        OutputError
            If the dataset cannot be written.
        """
        if name in self.datasets or name in self.failures:
            return self.datasets.get(name)
        try:
            scenario = self._scenario(name)
            kept = None if self.fresh else self._kept(name, scenario)
            self.datasets[name] = self._run(name, scenario, tell) if kept is None else kept
        except OutputError:
            raise
        except SimulationError as error:
            if isinstance(error.__cause__, KeyboardInterrupt):
                raise
            self.failures[name] = error
        return self.datasets.get(name)

    def _scenario(self, name: str) -> Scenario:
        return chosen(name, self.changes, self.cycles)

    def _run(self, name: str, scenario: Scenario, tell: Tell) -> xr.Dataset:
        def progress(at: Progress) -> None:
            tell(f"scene {name}", at.time / at.duration)

        try:
            dataset = run(scenario, positions_every=_interval(name, scenario), progress=progress)
        except RunError as error:
            save(error.dataset, self.path(name))
            raise
        save(dataset, self.path(name))
        return dataset

    def _kept(self, name: str, scenario: Scenario) -> xr.Dataset | None:
        try:
            dataset = xr.load_dataset(self.path(name), engine="netcdf4")
        except (OSError, ValueError):  # none, or a file that is no dataset of ours: run it
            return None
        same = (
            dataset.attrs.get("status") == COMPLETED
            and dataset.attrs.get("scenario") == scenario.portable_text
            and dataset.attrs.get("versions") == json.dumps(versions())
            and "snapshot_time" in dataset
            and np.allclose(np.diff(dataset["snapshot_time"]), _interval(name, scenario))
        )
        return dataset if same else None


def weights_of(dataset: xr.Dataset) -> Weights:
    """Weights of the scenario that a dataset came of."""
    return parse(dataset.attrs["scenario_name"], dataset.attrs["scenario"], Path()).weights


def whole_breaths(dataset: xr.Dataset) -> xr.Dataset:
    """Volumes of each breath, as `scenarios.breaths` gives them.

    Raises
    ------
    ScenarioError
        If the run has no complete breath.
    """
    seen = breaths(dataset)
    if seen.sizes["breath"] == 0:
        raise ScenarioError("the run has no complete breath; give it at least one cycle")
    return seen


def _interval(name: str, scenario: Scenario) -> float:
    """Time between two snapshots, s."""
    return STRIDES[name] * scenario.coupling.step
