"""The soft body S3D = ⟨O, F, V, N, C⟩ without its state: what acts on it, and what holds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.constraints import Constraint, Restraint
from softbody_core.forces import AirwayResistance, Force, InternalPressure, Rates
from softbody_core.forces.airway_resistance import BoundResistance
from softbody_core.forces.force import BoundForce
from softbody_core.ground.arrays import Floats
from softbody_core.ground.errors import ParameterError
from softbody_core.mesh import SurfaceMesh
from softbody_core.observation import Observation
from softbody_core.rigid import RigidBody
from softbody_core.state import Inputs, State
from softbody_core.weights import Weights


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
    forces : sequence of Force
        The laws that act; at most one of each class.
    weights : Weights
        α, β, γ, δ.
    constraints : sequence of Constraint
        What holds points, relates weights, or restrains the motion, in this order; contact is last.

    Raises
    ------
    ParameterError
        If the mass is not positive, or a law is given twice.
    """

    def __init__(
        self,
        mesh: SurfaceMesh,
        mass: float,
        forces: Sequence[Force],
        weights: Weights | None = None,
        constraints: Sequence[Constraint] = (),
    ) -> None:
        if not (np.isfinite(mass) and mass > 0):
            raise ParameterError(f"mass = {mass} kg: expected a positive number")
        kinds = [type(force) for force in forces]
        for kind in kinds:
            if kinds.count(kind) > 1:
                raise ParameterError(f"{kind.__name__} is given twice; give each law once")
        self.mesh = mesh
        self._given_weights = weights if weights is not None else Weights()
        self.weights = self._given_weights
        self.masses: Floats = mass * mesh.point_areas / mesh.area
        self._constraints = tuple(constraints)
        if sum(bool(one.obstacles) for one in constraints) > 1:
            raise ParameterError(
                "two constraints bring obstacles; put all rigid bodies into one Contact"
            )
        held = np.zeros(mesh.n_points, dtype=np.bool_)
        for constraint in constraints:
            held |= constraint.held(mesh)
        self.inverse_masses: Floats = np.where(held, 0.0, 1 / self.masses)
        bound = [one.bind(mesh, self.masses, self.inverse_masses) for one in constraints]
        self.restraints: list[Restraint] = sorted(
            (one for one in bound if one is not None), key=lambda one: one.last
        )
        self._laws = tuple(forces)
        self._bind_laws({})

    def _bind_laws(self, known: Mapping[Force, BoundForce]) -> None:
        """Bind the laws that have a weight; those known are bound already."""
        acting = [force for force in self._laws if self.weights.of(force.control) != 0]
        self._bound = {
            force: known.get(force) or force.bind(self.mesh, self.masses)
            for force in acting
            if not isinstance(force, AirwayResistance)
        }
        self.terms: list[tuple[float, BoundForce]] = [
            (self.weights.of(force.control), term) for force, term in self._bound.items()
        ]
        self.airway: BoundResistance | None = None
        self._pressure: InternalPressure | None = None
        for force in acting:
            if isinstance(force, AirwayResistance) and force.resistance > 0:
                self.airway = force.bind(self.mesh, self.masses)
            if isinstance(force, InternalPressure):
                self._pressure = force

    @property
    def obstacles(self) -> tuple[RigidBody, ...]:
        """Rigid bodies around the body."""
        return tuple(b for one in self._constraints for b in one.obstacles)

    @property
    def has_relations(self) -> bool:
        """Whether a constraint relates the weights."""
        return any(type(one).related is not Constraint.related for one in self._constraints)

    def related(self, seen: Observation) -> Weights:
        """Weights that the constraints ask for, of a body that is seen like this.

        Parameters
        ----------
        seen : Observation
            The body at the start of a communication step.
        """
        weights = self._given_weights
        for constraint in self._constraints:
            weights = constraint.related(weights, seen)
        return weights

    def reweighted(self, weights: Weights) -> SoftBodyModel:
        """Return this model with other weights; laws that are bound stay bound."""
        other = copy(self)
        other.weights = weights
        other._bind_laws(self._bound)  # noqa: SLF001 - of the same class
        return other

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        """Composite force of eq. 1, N, shape (3, n), without the airway's resistance."""
        total: Floats | None = None
        for weight, term in self.terms:
            force = term.force(configuration, velocities, inputs)
            if total is None:
                total = weight * force
            else:
                total += force if weight == 1.0 else weight * force
        return np.zeros_like(velocities) if total is None else total

    def total_force(
        self, configuration: Configuration, velocities: Floats, inputs: Inputs
    ) -> Floats:
        """Composite force and the airway's resistance, N, shape (3, n)."""
        total = self.force(configuration, velocities, inputs)
        if self.airway is not None:
            total += self.airway.force(configuration, velocities, inputs)
        return total

    def acceleration(
        self, configuration: Configuration, velocities: Floats, inputs: Inputs
    ) -> Floats:
        """Composite force over mass, m/s², without the airway's; zero at held points."""
        force = self.force(configuration, velocities, inputs)
        force *= self.inverse_masses
        return force

    def energy(self, state: State, inputs: Inputs) -> float | None:
        """Kinetic and potential energy, J; None if a force has no potential."""
        configuration = Configuration(self.mesh, state.positions)
        total = 0.5 * float(np.einsum("n,cn->", self.masses, state.velocities**2))
        for weight, term in self.terms:
            energy = term.energy(configuration, inputs)
            if energy is None:
                return None
            total += weight * energy
        return total

    def rates(self, configuration: Configuration, inputs: Inputs) -> Rates:
        """Bounds of the weighted forces together, without the airway's."""
        bounds = [(w, term.rates(configuration, inputs)) for w, term in self.terms]
        return Rates(
            sum(w * bound.stiffness for w, bound in bounds),
            sum(w * bound.damping for w, bound in bounds),
        )

    def pressure(self, configuration: Configuration, inputs: Inputs) -> float:
        """Pressure that drives the wall outward, γ (κN/B + ΔP), Pa."""
        if self._pressure is None:
            return 0.0
        gas_volume = self._pressure.gas_volume(configuration)
        return self.weights.gamma * self._pressure.pressure(gas_volume, inputs)

    def gas_volume(self, configuration: Configuration) -> float:
        """B, m³; the enclosed volume in a scene without pressure."""
        law = self._pressure
        return configuration.volume if law is None else law.gas_volume(configuration)

    def load(self, gas_volume: float, inputs: Inputs) -> float:
        """Force that the pressure exerts on the wall, over ∂V/∂x, Pa."""
        if self._pressure is None:
            return 0.0
        law = self._pressure
        return self.weights.gamma * law.share * law.pressure(gas_volume, inputs)

    @property
    def resistance(self) -> float:
        """R_aw, Pa·s/m³."""
        return 0.0 if self.airway is None else self.airway.law.resistance
