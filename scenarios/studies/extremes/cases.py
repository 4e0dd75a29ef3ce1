"""A case: one body under one steady drive."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cosim.units import unit
from scenarios.errors import ScenarioError
from scenarios.running.assemble import build_mesh
from scenarios.scene.scenario import Scenario
from scenarios.studies.extremes.shapes import SHAPES
from softbody_core import (
    AirwayResistance,
    Inputs,
    InternalPressure,
    MassSpring,
    SurfaceMesh,
    SurfaceSPH,
    Weights,
    fibonacci_sphere,
)
from softbody_core.constraints import Constraint
from softbody_core.forces import Law
from softbody_core.ground.parameters import quantities_of

STEPS: Final = 3
"""Communication steps of a case."""

_BENIGN: Final = Inputs(delta_p=200.0, n=500.0)
"""About 4 cmH2O in the bodies that ship: less than a quiet breath."""

_EXAMPLES: Final[Mapping[type[Any], Any]] = {
    MassSpring: MassSpring(375.0, 0.1),
    SurfaceSPH: SurfaceSPH(30.0, 1.0),
    InternalPressure: InternalPressure(2e-3),
    AirwayResistance: AirwayResistance(1e6),
}
"""Laws that are added where an axis needs one that the scenario does not name."""


@dataclass(frozen=True, eq=False)
class Case:
    """A body, where it starts, and what drives it; without an integrator.

    Attributes
    ----------
    mesh, mass, forces, weights, constraints
        As of `SoftBodyModel`.
    inputs : Inputs
        Held for all of the case.
    dt : float
        Communication step, s.
    start : ndarray, shape (n, 3), or None
        Where the points start, m; None at rest.
    """

    mesh: SurfaceMesh
    mass: float
    forces: tuple[Law, ...]
    weights: Weights
    constraints: tuple[Constraint, ...] = ()
    inputs: Inputs = _BENIGN
    dt: float = 1 / 30
    start: NDArray[np.float64] | None = None

    @classmethod
    def of(cls, scenario: Scenario) -> Case:
        """Take the body of a scenario, under a benign drive in place of its controller.

        Raises
        ------
        ScenarioError
            If there are obstacles: the extremes are those of a body alone.
        """
        if scenario.obstacles:
            raise ScenarioError(
                f"scenario {scenario.name} has obstacles, and the extremes are those of a body "
                "alone; take a scenario without them"
            )
        return cls(
            build_mesh(scenario.mesh, scenario.folder),
            scenario.body.mass,
            scenario.forces,
            scenario.weights,
            scenario.constraints,
            dt=scenario.coupling.step,
        )

    def with_law(self, kind: type[Any], **values: float) -> Case:
        """Change parameters of one law; a law that is not there is added."""
        laws: dict[type[Any], Any] = {type(force): force for force in self.forces}
        laws[kind] = replace(laws.get(kind, _EXAMPLES[kind]), **values)
        return replace(self, forces=tuple(laws.values()))

    def with_inputs(self, **values: float) -> Case:
        """Change the drive."""
        return replace(self, inputs=replace(self.inputs, **values))

    def weighted(self, **values: float) -> Case:
        """Change weights of eq. 1."""
        return replace(self, weights=replace(self.weights, **values))

    def with_mesh(self, mesh: SurfaceMesh) -> Case:
        """Take another surface, with as much gas in it as keeps the pressure."""
        share = mesh.volume / self.mesh.volume
        return replace(self.with_inputs(n=share * self.inputs.n), mesh=mesh)

    def with_radius(self, radius: float) -> Case:
        """Scale the surface and the gas in it, and nothing else."""
        return self.with_mesh(self.mesh.scaled(radius / self.radius))

    def with_points(self, count: int) -> Case:
        """Take a ball of the same volume; the more points, the shorter the case."""
        mesh = fibonacci_sphere(count).scaled_to_volume(self.mesh.volume)
        return replace(self.with_mesh(mesh), dt=min(self.dt, 10 / count))

    def shaped(self, shape: str) -> Case:
        """Take one of `SHAPES`; the fluid acts too, since it looks for neighbours."""
        mesh, start = SHAPES[shape](self.mesh)
        return replace(self.with_mesh(mesh).with_law(SurfaceSPH), start=start)

    @property
    def radius(self) -> float:
        """Radius of a ball of the rest volume, m."""
        return self.mesh.radius

    def in_own_units(self) -> Case:
        """Return the same case in other units: its mass, its radius and its step are 1.

        The body stands at the origin. By similarity nothing else changes, so a number in the core
        that has a unit and hides it shows up as a difference.
        """
        units = {"[mass]": self.mass, "[length]": self.radius, "[time]": self.dt}
        centre = self.mesh.points.mean(axis=0)

        def scaled(parameters: Any) -> Any:
            changes = {
                name: getattr(parameters, name)
                * math.prod(units[kind] ** -power for kind, power in unit(expected.unit).dimension)
                for name, expected in quantities_of(type(parameters)).items()
            }
            return replace(parameters, **changes)

        points = (self.mesh.points - centre) / self.radius
        return Case(
            SurfaceMesh.from_arrays(points, self.mesh.triangles),
            1.0,
            tuple(scaled(force) for force in self.forces),
            self.weights,
            self.constraints,
            scaled(self.inputs),
            1.0,
            None if self.start is None else (self.start - centre) / self.radius,
        )
