"""The soft body S3D = ⟨O, F, V, N, C⟩ without its state: what acts on it, and what holds it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.constraints import Constraint, Projection
from softbody_core.forces import BoundLaw, Law, Rates
from softbody_core.forces.volume_law import BoundPressure, BoundResistance, Volumes
from softbody_core.ground.arrays import Booleans, Floats
from softbody_core.ground.errors import ParameterError
from softbody_core.mesh import SurfaceMesh
from softbody_core.observation import Observation
from softbody_core.rigid import RigidBody
from softbody_core.state import Inputs, State
from softbody_core.weights import Control, Weights

_MOST_ITERATIONS = 100
_BALANCED = 1e-12
"""Pressure that is left, over the pressure that drives, at which a flow is found."""


class SoftBodyModel:
    """F_i = α F_b + β F_a + γ F_v + δ F_g on one surface (Mesit & Guha 2011, eq. 1).

    A law whose weight is 0 is never bound.

    Parameters
    ----------
    mesh : SurfaceMesh
        The surface at rest.
    mass : float
        Mass of the whole body, kg, spread over the points by their share of the surface, so that
        results converge as the mesh is refined.
    forces : sequence of Law
        The laws that act; at most one of each class.
    weights : Weights
        α, β, γ, δ.
    constraints : sequence of Constraint
        What holds points, relates weights, or corrects the motion, in this order; contact is last.

    Attributes
    ----------
    terms : list of (float, BoundLaw)
        The laws of eq. 1 with their weights.
    pressures : list of (float, BoundPressure)
        Those of `terms` that act along ∂V/∂x.
    resistances : list of (float, BoundResistance)
        What resists the flow. It is no part of `terms`: each integrator takes it in its own way.
    projections : list of Projection
        What corrects the motion after each inner step, in this order.

    Raises
    ------
    ParameterError
        If the mass is not positive, or a law is given twice.
    """

    def __init__(
        self,
        mesh: SurfaceMesh,
        mass: float,
        forces: Sequence[Law],
        weights: Weights | None = None,
        constraints: Sequence[Constraint] = (),
    ) -> None:
        if not (np.isfinite(mass) and mass > 0):
            raise ParameterError(f"mass = {mass} kg: expected a positive number")
        kinds = [type(law) for law in forces]
        for kind in kinds:
            if kinds.count(kind) > 1:
                raise ParameterError(f"{kind.__name__} is given twice; give each law once")
        if sum(bool(constraint.obstacles) for constraint in constraints) > 1:
            raise ParameterError(
                "two constraints bring obstacles; put all rigid bodies into one Contact"
            )
        self.mesh = mesh
        self.laws = tuple(forces)
        self.weights = self._given_weights = weights if weights is not None else Weights()
        self.masses: Floats = mass * mesh.point_areas / mesh.area
        self.inverse_masses: Floats = np.where(_held(mesh, constraints), 0.0, 1 / self.masses)
        self._constraints = tuple(constraints)
        self.projections = self._bind_constraints()
        self._bind_laws({})

    def _bind_constraints(self) -> list[Projection]:
        mesh, masses, inverse_masses = self.mesh, self.masses, self.inverse_masses
        bound = [c.bind(mesh, masses, inverse_masses) for c in self._constraints]
        projections = [projection for projection in bound if projection is not None]
        return sorted(projections, key=lambda projection: projection.last)

    def _bind_laws(self, known: Mapping[Law, BoundLaw[Law]]) -> None:
        """Bind the laws that act and have a weight; those known are bound already."""
        acting = [law for law in self.laws if law.acts and self.weights.of(law.control) != 0]
        self._bound = {law: known.get(law) or law.bind(self.mesh, self.masses) for law in acting}
        weighted = [(self.weights.of(law.control), bound) for law, bound in self._bound.items()]
        self.terms = [(w, law) for w, law in weighted if not isinstance(law, BoundResistance)]
        self.pressures = [(w, law) for w, law in weighted if isinstance(law, BoundPressure)]
        self.resistances = [(w, law) for w, law in weighted if isinstance(law, BoundResistance)]

    @property
    def obstacles(self) -> tuple[RigidBody, ...]:
        """Rigid bodies around the body."""
        return tuple(body for constraint in self._constraints for body in constraint.obstacles)

    @property
    def has_relations(self) -> bool:
        """Whether a constraint relates the weights."""
        return any(type(c).related is not Constraint.related for c in self._constraints)

    def related(self, observation: Observation) -> Weights:
        """Weights that the constraints ask for.

        Parameters
        ----------
        observation : Observation
            The body at the start of a communication step.
        """
        weights = self._given_weights
        for constraint in self._constraints:
            weights = constraint.related(weights, observation)
        return weights

    def reweighted(self, weights: Weights) -> SoftBodyModel:
        """Return this model with other weights; laws that are bound stay bound."""
        other = copy(self)
        other.weights = weights
        other._bind_laws(self._bound)  # noqa: SLF001 - of the same class
        return other

    def without_pressures(self) -> SoftBodyModel:
        """Return this model without the laws along ∂V/∂x.

        Those change the volume of a body at rest, and not the shape that it has at a volume.
        """
        other = copy(self)
        other.terms = [term for term in self.terms if term not in self.pressures]
        other.pressures, other.resistances = [], []
        return other

    # Forces on the points

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        """F_i = α F_b + β F_a + γ F_v + δ F_g, N, shape (3, n), without what resists the flow."""
        if not self.terms:
            return np.zeros_like(velocities)
        (weight, law), *others = self.terms
        total: Floats = weight * law.force(configuration, velocities, inputs)
        for weight, law in others:
            force = law.force(configuration, velocities, inputs)
            total += force if weight == 1.0 else weight * force
        return total

    def total_force(
        self, configuration: Configuration, velocities: Floats, inputs: Inputs
    ) -> Floats:
        """Composite force and what resists the flow, N, shape (3, n)."""
        total = self.force(configuration, velocities, inputs)
        for weight, law in self.resistances:
            total += weight * law.force(configuration, velocities, inputs)
        return total

    def acceleration(
        self, configuration: Configuration, velocities: Floats, inputs: Inputs
    ) -> Floats:
        """F_i/m_i, m/s², without what resists the flow; zero at held points."""
        force = self.force(configuration, velocities, inputs)
        force *= self.inverse_masses
        return force

    def energy(self, state: State, inputs: Inputs) -> float | None:
        """Kinetic and potential energy, J; None if a force has no potential."""
        configuration = Configuration(self.mesh, state.positions)
        total = 0.5 * float(np.einsum("n,cn->", self.masses, state.velocities**2))
        for weight, law in self.terms:
            energy = law.energy(configuration, inputs)
            if energy is None:
                return None
            total += weight * energy
        return total

    def rates(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Rates:
        """Bounds of the weighted forces together, without what resists the flow."""
        bounds = [(w, law.rates(configuration, velocities, inputs)) for w, law in self.terms]
        return Rates(
            sum(w * bound.stiffness for w, bound in bounds),
            sum(w * bound.damping for w, bound in bounds),
        )

    # Pressures on the whole wall: one number each, and their sums

    def pressure(self, volumes: Volumes, inputs: Inputs) -> float:
        """Pressure that drives the wall outward, γ (κN/B + ΔP), Pa."""
        driving = [(w, p.law) for w, p in self.pressures if p.law.control is Control.VOLUME]
        return sum((w * law.pressure(volumes, inputs) for w, law in driving), 0.0)

    def load(self, volumes: Volumes, inputs: Inputs) -> float:
        """Force of all laws of pressure on the wall, over ∂V/∂x, Pa."""
        laws = [(w * p.law.share, p.law) for w, p in self.pressures]
        return sum((w * law.pressure(volumes, inputs) for w, law in laws), 0.0)

    def resistance(self, flow: float) -> float:
        """R at a flow into the body, m³/s: pressure that it costs, over the flow, Pa·s/m³."""
        return sum((w * r.law.resistance_at(flow) for w, r in self.resistances), 0.0)

    def differential_resistance(self, flow: float) -> float:
        """d(RQ)/dQ at a flow Q, m³/s, Pa·s/m³."""
        return sum((w * r.law.differential_resistance_at(flow) for w, r in self.resistances), 0.0)

    def driven_flow(self, pressure: float, drag: float = 0.0) -> float:
        """Flow Q, m³/s, that a pressure drives where something resists: (R(Q) + drag) Q = p."""
        guess = math.copysign(self.mesh.volume, pressure)  # in a second; any of that sign would do
        flow = pressure / (self.resistance(guess) + drag)
        for _ in range(_MOST_ITERATIONS):  # Newton's method; R rises with |Q|, or is constant
            missing = pressure - (self.resistance(flow) + drag) * flow
            if not abs(missing) > _BALANCED * abs(pressure):
                break
            flow += missing / (self.differential_resistance(flow) + drag)
        return flow


def _held(mesh: SurfaceMesh, constraints: Sequence[Constraint]) -> Booleans:
    """Return True for each point that a constraint holds, shape (n,)."""
    held = np.zeros(mesh.n_points, dtype=np.bool_)
    for constraint in constraints:
        held |= constraint.held(mesh)
    return held
