"""What a scenario is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from softbody_core import Weights
from softbody_core.constraints import Constraint
from softbody_core.forces import Force
from softbody_core.integrators import Integrator
from softbody_core.parameters import Parameters, Quantity

ControllerValue = float | int | bool | str


@dataclass(frozen=True)
class Mesh(Parameters):
    """Where the surface comes from: exactly one of `lung`, `file`, `icosphere` and `ball`.

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
    unit : str, optional
        Unit of a file's coordinates, such as "mm"; metres by default.
    volume : float, optional
        Enclosed volume to scale the surface to, m³; a sphere needs it.
    weld : bool
        Merge points at the same position.
    """

    lung: str | None = None
    file: str | None = None
    unit: str | None = None
    icosphere: int | None = None
    ball: int | None = None
    volume: Annotated[float | None, Quantity("m^3", above=0)] = None
    weld: bool = False


@dataclass(frozen=True)
class Body(Parameters):
    """Mass of the body, kg."""

    mass: Annotated[float, Quantity("kg", above=0)]


@dataclass(frozen=True)
class Controller:
    """A controller that ships, or an FMU file, and what its parameters are set to."""

    use: str
    parameters: Mapping[str, ControllerValue] = field(default_factory=dict)

    @property
    def key(self) -> str:
        """Name of the table of its parameters: its own name, or that of its file."""
        return Path(self.use).stem if self.use.endswith(".fmu") else self.use


@dataclass(frozen=True)
class Coupling(Parameters):
    """Coupling algorithm and communication step, s."""

    step: Annotated[float, Quantity("s", above=0)]
    algorithm: str = "gauss-seidel"


@dataclass(frozen=True)
class Run(Parameters):
    """Length of a run: `cycles` breaths of `period` seconds."""

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
        The body.
    controller, coupling, run
        What drives it, how they are coupled, and for how long.
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
    forces: tuple[Force, ...]
    constraints: tuple[Constraint, ...]
    controller: Controller
    integrator: Integrator
    coupling: Coupling
    run: Run
    text: str
    folder: Path

    def changed(self, changes: Mapping[str, Any]) -> Scenario:
        """Return this scenario with values replaced, by dotted path."""
        from scenarios.parse import parse  # which makes scenarios, and so imports this

        return parse(self.name, self.text, self.folder, changes)

    @property
    def steps(self) -> int:
        """Number of communication steps."""
        return max(1, round(self.run.cycles * self.run.period / self.coupling.step))
