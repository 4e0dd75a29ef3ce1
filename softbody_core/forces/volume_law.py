"""Laws along ∂V/∂x: a pressure on the inside of the whole wall, F_i = p ∂V/∂x_i.

Such a law is one number a configuration. The model adds up those numbers, so that a second
pressure, a recoil or another resistance is a file of its own. A `PressureLaw` gives p of the
body's volumes and inputs; a `ResistanceLaw` gives R of the flow Q = dV/dt, and p = −R Q.

A law along ∂V/∂x changes the volume of a body, and not the shape that it has at a volume. It
couples all points with all others, by parts of rank one.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from softbody_core.configuration import Configuration, norms
from softbody_core.forces.law import BoundLaw, Law, Rates
from softbody_core.ground.arrays import Floats
from softbody_core.mesh import SurfaceMesh
from softbody_core.state import Inputs


class Volumes(Protocol):
    """What a pressure may depend on: a `Configuration`, or the two numbers alone."""

    @property
    def volume(self) -> float:
        """Enclosed volume V, m³."""

    @property
    def bounding_box_volume(self) -> float:
        """Volume B of the axis-aligned bounding box, m³."""


class Slopes(NamedTuple):
    """∂p/∂V and ∂p/∂B, Pa/m³."""

    volume: float = 0.0
    bounding_box_volume: float = 0.0


class RankOne(NamedTuple):
    """The matrix coefficient · left rightᵀ; both vectors have shape (3, n)."""

    coefficient: float
    left: Floats
    right: Floats


@dataclass(frozen=True)
class PressureLaw(Law):
    """F_i = share · p ∂V/∂x_i, with p of the body's volumes and inputs.

    With the control `Control.VOLUME` p counts as pressure that drives the body; with another, such
    as `Control.STRUCTURE` for a recoil, as part of what the driving pressure works against.
    """

    @property
    def share(self) -> float:
        """Area that a point feels, as a multiple of ∂V/∂x."""
        return 1.0

    @abstractmethod
    def pressure(self, volumes: Volumes, inputs: Inputs) -> float:
        """Return p, Pa, positive outward."""

    @abstractmethod
    def slopes(self, volumes: Volumes, inputs: Inputs) -> Slopes:
        """Return ∂p/∂V and ∂p/∂B at held inputs, Pa/m³."""

    def potential(self, volumes: Volumes, inputs: Inputs) -> float | None:
        """−∫ p dV at held inputs, J; None where p is of another volume than V."""
        return None

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundPressure:
        """Put the pressure on the inside of one surface."""
        return BoundPressure(self, mesh, masses)


class BoundPressure(BoundLaw[PressureLaw]):
    """A pressure inside one surface."""

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        return self._load(configuration, inputs) * configuration.volume_gradient

    def _load(self, configuration: Configuration, inputs: Inputs) -> float:
        return self.law.share * self.law.pressure(configuration, inputs)

    def energy(self, configuration: Configuration, inputs: Inputs) -> float | None:
        potential = self.law.potential(configuration, inputs)
        return None if potential is None else self.law.share * potential

    def rank_one_stiffness(
        self, configuration: Configuration, inputs: Inputs
    ) -> tuple[RankOne, ...]:
        """−∂V/∂x ∂p/∂x, such as that of a gas that stiffens as it is squeezed."""
        in_volume, in_box = self.law.slopes(configuration, inputs)
        area, share = configuration.volume_gradient, self.law.share
        parts = []
        if in_volume:
            parts.append(RankOne(-share * in_volume, area, area))
        if in_box:
            parts.append(RankOne(-share * in_box, area, configuration.bounding_box_gradient))
        return tuple(parts)

    def rates(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Rates:
        # Block row sums of ∂A/∂x, whose block for edge (i, j) with wings a, b is [x_a − x_b]×/6.
        wings = norms(
            configuration.positions[:, self.mesh.edge_wings[:, 0]]
            - configuration.positions[:, self.mesh.edge_wings[:, 1]]
        )
        ends = self.mesh.edges
        row_sums = np.bincount(ends.ravel(), np.repeat(wings / 6, 2), len(self.masses))
        bound = abs(self._load(configuration, inputs)) * float(np.max(row_sums / self.masses))
        for coefficient, left, right in self.rank_one_stiffness(configuration, inputs):
            sizes = (np.linalg.norm(v / np.sqrt(self.masses)) for v in (left, right))
            bound += abs(coefficient) * float(np.prod(list(sizes)))
        return Rates(stiffness=bound)


@dataclass(frozen=True)
class ResistanceLaw(Law):
    """F_i = −R Q ∂V/∂x_i, with R of the flow Q = dV/dt.

    Integrators take resistance apart from the other forces: it may be so large that no explicit
    step would be short enough, and it acts in one direction alone.
    """

    @abstractmethod
    def resistance_at(self, flow: float) -> float:
        """Return R, at least 0, Pa·s/m³, at a flow into the body, m³/s."""

    def differential_resistance_at(self, flow: float) -> float:
        """d(RQ)/dQ, at least R, Pa·s/m³; to be overridden where R is no constant."""
        return self.resistance_at(flow)

    @property
    def follows_flow(self) -> bool:
        """Whether R depends on the flow."""
        kind = type(self)
        return kind.differential_resistance_at is not ResistanceLaw.differential_resistance_at

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundResistance:
        """Put the resistance on one surface."""
        return BoundResistance(self, mesh, masses)


class BoundResistance(BoundLaw[ResistanceLaw]):
    """What resists the flow into one surface."""

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        gradient = configuration.volume_gradient
        flow = float(np.vdot(gradient, velocities))
        return (-self.law.resistance_at(flow) * flow) * gradient

    def rank_one_damping(self, configuration: Configuration, velocities: Floats) -> RankOne:
        """∂V/∂x d(RQ)/dQ ∂V/∂x."""
        gradient = configuration.volume_gradient
        flow = float(np.vdot(gradient, velocities))
        return RankOne(self.law.differential_resistance_at(flow), gradient, gradient)

    def rates(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Rates:
        coefficient, gradient, _ = self.rank_one_damping(configuration, velocities)
        return Rates(damping=coefficient * float(np.vdot(gradient, gradient / self.masses)))
