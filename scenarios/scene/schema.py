"""What stands in each table of a scenario.

This is the whole layout of the file: a new field is a line here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from cosim.algorithms import ALGORITHMS, Algorithm, GaussSeidel
from scenarios.scene.controller import Controller, read_controller
from scenarios.scene.forms import ByName, EachOf, OneOf, ReadBy
from scenarios.scene.layout import In, Refusing
from softbody_core import (
    CONSTRAINTS,
    FORCES,
    INTEGRATORS,
    Contact,
    Inputs,
    VelocityVerlet,
    Weights,
)
from softbody_core.constraints import Constraint
from softbody_core.forces import Law
from softbody_core.forces.gravity import STANDARD_GRAVITY
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.integrators import Integrator

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Mesh(Parameters):
    """Where the surface comes from: exactly one of `lung`, `file`, `icosphere`, `ball` and `glass`.

    Parameters
    ----------
    lung : str, optional
        A surface that ships, by name.
    file : str, optional
        A surface file, relative to the scenario's folder.
    icosphere : int, optional
        Subdivisions of an icosphere: 2, 3, 4 give 162, 642, 2562 points.
    ball : int, optional
        Number of points of a ball of Fibonacci points.
    glass : int, optional
        Segments of a full turn of a wine glass, 205 mm high.
    unit : str, optional
        Unit of a file's coordinates, such as "mm"; metres by default.
    volume : float, optional
        Enclosed volume to scale the surface to, m³; a sphere needs it.
    position : tuple of float
        Where the origin of the surface's own coordinates is put, m.
    weld : bool
        Merge points at the same position.
    """

    lung: str | None = None
    file: str | None = None
    unit: str | None = None
    icosphere: int | None = None
    ball: int | None = None
    glass: int | None = None
    position: Annotated[Vector, Quantity("m")] = (0.0, 0.0, 0.0)
    volume: Annotated[float | None, Quantity("m^3", above=0)] = None
    weld: bool = False


@dataclass(frozen=True)
class Obstacle(Parameters):
    """A rigid body around the soft one; see `softbody_core.RigidBody`.

    Parameters
    ----------
    name : str
        Key of its table.
    mesh : Mesh
        Its surface.
    motion : {"fixed", "driven", "free"}
        Whether it stays, keeps its velocities, or obeys forces.
    mass : float, optional
        kg; a free one needs it.
    velocity, angular_velocity, force : tuple of float
        At its centre of mass, m/s, rad/s and N.
    gravity : float
        |g| along −z, m/s².
    """

    name: str
    mesh: Mesh
    motion: Literal["fixed", "driven", "free"] = "fixed"
    mass: Annotated[float | None, Quantity("kg", above=0)] = None
    velocity: Annotated[Vector, Quantity("m/s")] = (0.0, 0.0, 0.0)
    angular_velocity: Annotated[Vector, Quantity("rad/s")] = (0.0, 0.0, 0.0)
    force: Annotated[Vector, Quantity("N")] = (0.0, 0.0, 0.0)
    gravity: Annotated[float, Quantity("m/s^2", at_least=0)] = STANDARD_GRAVITY


@dataclass(frozen=True)
class Body(Parameters):
    """Mass of the body, kg."""

    mass: Annotated[float, Quantity("kg", above=0)]


@dataclass(frozen=True)
class Coupling(Parameters):
    """Communication step, s, and coupling algorithm."""

    step: Annotated[float, Quantity("s", above=0)]
    algorithm: Annotated[
        Algorithm, OneOf(ALGORITHMS, "algorithm", default="gauss-seidel", implied=True), In("")
    ] = field(default_factory=GaussSeidel)


@dataclass(frozen=True)
class Run(Parameters):
    """Length of a run: `cycles` breaths, or whatever it repeats, of `period` seconds."""

    period: Annotated[float, Quantity("s", above=0)]
    cycles: Annotated[int, Quantity("1", at_least=1)] = 5


@dataclass(frozen=True)
class Scene:
    """The tables of a scenario, a field a table; but laws and their weights share ``[forces]``.

    Attributes
    ----------
    title : str
        One line.
    mesh, body, weights, forces, constraints, integrator
        The body.
    obstacles, contact
        Rigid bodies around it, and how it touches them.
    controller, inputs, coupling, run
        What drives it, or the inputs that are held where nothing does; how they are coupled, and
        for how long.
    """

    title: str
    mesh: Mesh
    body: Body
    weights: Annotated[Weights, In("forces")]
    forces: Annotated[tuple[Law, ...], EachOf(FORCES), In("forces")]
    coupling: Coupling
    run: Run
    constraints: Annotated[tuple[Constraint, ...], EachOf(CONSTRAINTS, lists=True)] = ()
    obstacles: Annotated[tuple[Obstacle, ...], ByName(Obstacle, "name")] = ()
    contact: Annotated[
        Contact, Refusing("bodies", "give each obstacle a table [obstacles.NAME]")
    ] = field(default_factory=Contact)
    controller: Annotated[Controller | None, ReadBy(read_controller)] = None
    inputs: Inputs = field(default_factory=Inputs)
    integrator: Annotated[Integrator, OneOf(INTEGRATORS, "method", default="velocity-verlet")] = (
        field(default_factory=VelocityVerlet)
    )

    @property
    def steps(self) -> int:
        """Number of communication steps."""
        return max(1, round(self.run.cycles * self.run.period / self.coupling.step))
