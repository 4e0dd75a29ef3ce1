"""The scenes behind the paper's figures: each is run once, and kept for the next call."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from scenarios.errors import Interrupted, OutputError, RunError, ScenarioError
from scenarios.results.files import save
from scenarios.running.machine import versions
from scenarios.running.progress import Progress, StudyProgress, Watch
from scenarios.running.run import COMPLETED, run
from scenarios.scene.catalogue import load
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


@dataclass
class Scenes:
    """Datasets of scenes: kept in a folder, or run.

    Attributes
    ----------
    folder : Path
        Holds NAME.nc of each scene.
    load : callable
        From a scene's name to its scenario.
    fresh : bool
        Do not take what the folder holds.
    datasets : dict
        What has come of the scenes so far.
    failures : dict
        Why a scene has no dataset here.
    """

    folder: Path
    load: Callable[[str], Scenario] = load
    fresh: bool = False
    datasets: dict[str, xr.Dataset] = field(default_factory=dict)
    failures: dict[str, SimulationError] = field(default_factory=dict)

    def path(self, name: str) -> Path:
        """Where a scene's dataset is kept."""
        return self.folder / f"{name}.nc"

    def get_all(self, names: Sequence[str], watch: Watch) -> None:
        """Get each scene once; see `get`.

        Raises
        ------
        ScenarioError
            If none of them can be loaded: the changes that they bear are a mistake then.
        """
        needed = list(dict.fromkeys(names))
        self._check(needed)
        for name in needed:
            self.get(name, watch)

    def _check(self, names: Sequence[str]) -> None:
        errors = []
        for name in names:
            try:
                self.load(name)
            except ScenarioError as error:
                errors.append(error)
        if errors and len(errors) == len(names):
            raise errors[0]

    def look(self, name: str) -> xr.Dataset | None:
        """Return what the folder holds of a scene, if it would come out the same again."""
        if self.fresh or not self.path(name).exists():
            return None
        try:
            return self._from_folder(name, self.load(name))
        except ScenarioError:  # changes that were meant for other scenes
            return None

    def get(self, name: str, watch: Watch) -> xr.Dataset | None:
        """Take a scene from the folder, or run it and keep it; None if it failed.

        Raises
        ------
        Interrupted
            If the run was interrupted; what was computed is kept.
        OutputError
            If the dataset cannot be written.
        """
        if name in self.datasets or name in self.failures:
            return self.datasets.get(name)
        try:
            scenario = self.load(name)
            dataset = None if self.fresh else self._from_folder(name, scenario)
            if dataset is None:
                dataset = self._run(name, scenario, watch)
            self.datasets[name] = dataset
        except (OutputError, Interrupted):
            raise
        except SimulationError as error:
            self.failures[name] = error
        return self.datasets.get(name)

    def _run(self, name: str, scenario: Scenario, watch: Watch) -> xr.Dataset:
        def progress(at: Progress) -> None:
            watch(StudyProgress(f"scene {name}", at.time / at.duration, 1))

        try:
            dataset = run(scenario, positions_every=_interval(name, scenario), progress=progress)
        except RunError as error:
            save(error.dataset, self.path(name))
            raise
        save(dataset, self.path(name))
        return dataset

    def _from_folder(self, name: str, scenario: Scenario) -> xr.Dataset | None:
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


def _interval(name: str, scenario: Scenario) -> float:
    """Time between two snapshots, s."""
    return STRIDES[name] * scenario.coupling.step
