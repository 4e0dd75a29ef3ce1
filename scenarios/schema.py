"""What a scenario is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from cosim.algorithms import Algorithm, GaussSeidel
from cosim.fmu.isolation import TIME_LIMIT
from cosim.matching import PortName
from softbody_core import Contact, Inputs, Weights
from softbody_core.constraints import Constraint
from softbody_core.forces import Law
from softbody_core.forces.gravity import STANDARD_GRAVITY
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.integrators import Integrator

ControllerValue = float | int | bool | str
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
class Isolation(Parameters):
    """Where an FMU runs.

    Parameters
    ----------
    isolation : str
        "none" for this process, "process" for one of its own.
    time_limit : float
        In its own process, how long it may take to answer one call, s.
    """

    isolation: str = "none"
    time_limit: Annotated[float, Quantity("s", above=0)] = TIME_LIMIT


@dataclass(frozen=True)
class Controller:
    """What drives the body.

    Attributes
    ----------
    use : str
        A controller that ships, or an FMU file.
    parameters : mapping
        What its parameters are set to.
    isolation : Isolation
        Where it runs.
    ports : mapping
        By port of the body, its name in the FMU, where that differs.
    """

    use: str
    parameters: Mapping[str, ControllerValue] = field(default_factory=dict)
    isolation: Isolation = Isolation()
    ports: Mapping[str, PortName] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Name of the table of its parameters: its own name, or that of its file."""
        return Path(self.use).stem if self.use.endswith(".fmu") else self.use


@dataclass(frozen=True)
class Coupling(Parameters):
    """Communication step, s, and coupling algorithm."""

    step: Annotated[float, Quantity("s", above=0)]
    algorithm: Algorithm = field(default_factory=GaussSeidel)


@dataclass(frozen=True)
class Run(Parameters):
    """Length of a run: `cycles` breaths, or whatever it repeats, of `period` seconds."""

    period: Annotated[float, Quantity("s", above=0)]
    cycles: Annotated[int, Quantity("1", at_least=1)] = 5


@dataclass(frozen=True)
class Scenario:
    """Everything that decides a result. Read one with `scenarios.load`.

    Attributes
    ----------
    name, title : str
        Short and long.
    mesh, body, weights, forces, constraints, integrator
        The body; where there are several, the first one.
    bodies : mapping
        Where there are several: each as a scenario of its own, by name.
    obstacles, contact
        Rigid bodies around it, and how it touches them.
    controller, inputs, coupling, run
        What drives it, or the inputs that are held where nothing does; how they are coupled, and
        for how long.
    text : str
        The scenario as TOML; loading it again gives an equal scenario.
    folder : Path
        Against which relative paths in it are read.
    """

    name: str
    title: str
    mesh: Mesh
    body: Body
    weights: Weights
    forces: tuple[Law, ...]
    constraints: tuple[Constraint, ...]
    obstacles: tuple[Obstacle, ...]
    contact: Contact
    controller: Controller | None
    inputs: Inputs
    integrator: Integrator
    coupling: Coupling
    run: Run
    text: str
    folder: Path
    bodies: Mapping[str, Scenario] = field(default_factory=dict)

    def changed(self, changes: Mapping[str, Any]) -> Scenario:
        """Return this scenario with values replaced, by dotted path."""
        from scenarios.parse import parse  # which makes scenarios, and so imports this

        return parse(self.name, self.text, self.folder, changes)

    @property
    def steps(self) -> int:
        """Number of communication steps."""
        return max(1, round(self.run.cycles * self.run.period / self.coupling.step))
