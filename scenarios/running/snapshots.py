"""Positions of all points at chosen moments of a run."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from scenarios.errors import ScenarioError
from scenarios.scene.scenario import Scenario
from softbody_core import SoftBody


class Snapshots:
    """Positions of all points at chosen communication points.

    Parameters
    ----------
    body : SoftBody
        Whose points.
    scenario : Scenario
        For the communication step.
    every : float or None
        Interval, s; None takes nothing.
    prefix : str
        What the names of its variables begin with.
    """

    def __init__(
        self, body: SoftBody, scenario: Scenario, every: float | None, prefix: str = ""
    ) -> None:
        self._body = body
        self._prefix = prefix
        self._stride = 0
        if every is not None:
            strides = every / scenario.coupling.step
            self._stride = round(strides) if np.isfinite(strides) else 0
            if self._stride < 1 or abs(strides - self._stride) > 1e-6:
                raise ScenarioError(
                    f"positions every {every:g} s: expected a multiple of the communication "
                    f"step, {scenario.coupling.step:.6g} s"
                )
        self._times: list[float] = []
        self._positions: list[np.ndarray] = []
        self._obstacles: list[np.ndarray] = []

    def take(self, index: int) -> None:
        """Take the positions if it is time to."""
        if self._stride and index % self._stride == 0:
            self._times.append(self._body.time)
            self._positions.append(self._body.positions)
            placed = zip(self._body.model.obstacles, self._body.state.obstacles, strict=True)
            surfaces = [obstacle.surface(state) for obstacle, state in placed]
            if surfaces:
                self._obstacles.append(np.concatenate(surfaces))

    def serialize(self) -> dict[str, np.ndarray]:
        """Everything that was taken, as arrays that are not empty."""
        lists = {
            "snapshot_times": self._times,
            "positions": self._positions,
            "obstacles": self._obstacles,
        }
        return {self._prefix + name: np.array(values) for name, values in lists.items() if values}

    def deserialize(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Start from what `serialize` gave, in place of what is there."""
        self._times = list(arrays.get(f"{self._prefix}snapshot_times", ()))
        self._positions = list(arrays.get(f"{self._prefix}positions", ()))
        self._obstacles = list(arrays.get(f"{self._prefix}obstacles", ()))

    def add_to(self, dataset: xr.Dataset) -> xr.Dataset:
        """Add what was taken to a dataset."""
        if not self._stride:
            return dataset
        prefix = self._prefix
        points = {"units": "m", "long_name": "point position"}
        time = {"units": "s", "long_name": "time of the snapshot"}
        corners = {"units": "1", "long_name": "point indices of the triangles, outward"}
        positions, triangles = np.stack(self._positions), self._body.model.mesh.triangles
        dataset = dataset.assign(
            {
                f"{prefix}position": (("snapshot", f"{prefix}point", "axis"), positions, points),
                f"{prefix}triangles": ((f"{prefix}triangle", "corner"), triangles, corners),
            }
        ).assign_coords(snapshot_time=("snapshot", np.array(self._times), time))
        return dataset.assign(self._surfaces()) if self._obstacles else dataset

    def _surfaces(self) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
        """All obstacles as one surface: once if none moves, at each snapshot otherwise."""
        meshes = [obstacle.mesh for obstacle in self._body.model.obstacles]
        offsets = np.cumsum([0, *(mesh.n_points for mesh in meshes[:-1])])
        triangles = [m.triangles + offset for m, offset in zip(meshes, offsets, strict=True)]
        points = {"units": "m", "long_name": "points of the obstacles' surfaces"}
        corners = {"units": "1", "long_name": "point indices of the obstacles' triangles, outward"}
        still = not any(obstacle.moves for obstacle in self._body.model.obstacles)
        return {
            "obstacle_points": (("obstacle_point", "axis"), self._obstacles[0], points)
            if still
            else (("snapshot", "obstacle_point", "axis"), np.stack(self._obstacles), points),
            "obstacle_triangles": (
                ("obstacle_triangle", "corner"),
                np.concatenate(triangles),
                corners,
            ),
        }
