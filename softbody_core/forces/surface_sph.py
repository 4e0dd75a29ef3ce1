"""Anamorphosis control: a fluid among the surface points (Mesit & Guha 2011, eqs 5-9).

Kernels: Müller, Charypar & Gross 2003, "Particle-based fluid simulation for interactive
applications", eqs 20-22.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.forces.law import BoundLaw, Law, Majorants, Rates
from softbody_core.forces.pair_geometry import PairGeometry
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Quantity
from softbody_core.mesh import SurfaceMesh
from softbody_core.neighbours import NeighbourList
from softbody_core.state import Inputs
from softbody_core.weights import Control


@dataclass(frozen=True)
class SurfaceSPH(Law):
    """Smoothed particle hydrodynamics among surface points within the core radius h_w.

    ρ_i = Σ_j m_j W_poly6(r_ij),  L_i = k (ρ_i − ρ⁰_i)

    F_i = Σ_j m_i m_j/(ρ_i ρ_j) [−(L_i + L_j)/2 ∇W_spiky + μ (v_j − v_i) ∇²W_viscosity]

    Eq. 7 is printed with L_i − L_j; only the sum, as in Müller et al. 2003, conserves momentum.
    Eqs 7 and 8 are force densities; times m_i/ρ_i they are newtons. The initial density ρ⁰ of
    eq. 6 is each point's own, times `rest_density`: at 1 the body rests in its rest shape, below 1
    the fluid is compressed there and pushes the surface apart.

    Parameters
    ----------
    gas_constant : float
        k, m²/s².
    viscosity : float
        μ, Pa·s.
    core_radius : float
        h_w in mean edge lengths of the surface at rest.
    rest_density : float
        ρ⁰ over the density of each point in the rest shape.
    pressure : {"sum", "difference"}
        ``"difference"`` is eq. 7 as printed.
    """

    control: ClassVar[Control | None] = Control.ANAMORPHOSIS

    gas_constant: Annotated[float, Quantity("m^2/s^2", at_least=0)]
    viscosity: Annotated[float, Quantity("Pa.s", at_least=0)] = 0.0
    core_radius: Annotated[float, Quantity("1", above=0)] = 2.0
    rest_density: Annotated[float, Quantity("1", at_least=0)] = 1.0
    pressure: Literal["sum", "difference"] = "sum"

    @property
    def internal(self) -> bool:
        """False for eq. 7 as printed, which conserves no momentum."""
        return self.pressure == "sum"

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundLaw[Law]:
        """Find neighbours and densities at rest."""
        return _BoundSPH(self, mesh, masses)


class _BoundSPH(BoundLaw[SurfaceSPH]):
    def __init__(self, law: SurfaceSPH, mesh: SurfaceMesh, masses: Floats) -> None:
        super().__init__(law, mesh, masses)
        self._radius = h = law.core_radius * float(mesh.edge_lengths.mean())
        self._neighbours = NeighbourList(h)
        self._geometry: PairGeometry | None = None
        self._shares, self._mean_pressures = np.empty((2, 0))
        self._poly6 = 315 / (64 * np.pi * h**9)  # W = poly6 (h² − r²)³
        self._spiky = 45 / (np.pi * h**6)  # −∇W = spiky (h − r)² r̂, ∇²W_viscosity = spiky (h − r)
        self._rest = Configuration(mesh, np.ascontiguousarray(mesh.points.T))
        geometry = self._look(self._rest.positions)
        self._rest_densities = law.rest_density * self._densities(geometry)

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        geometry, _ = self._fluid(configuration)
        carried = geometry.vectors
        carried *= self._push(geometry)
        if not self.law.viscosity:
            return self._pushed(geometry, carried)
        drag = self._drag(geometry, velocities)
        if not self.law.internal:
            return self._pushed(geometry, carried) - geometry.onto_ends(drag)
        carried -= drag
        return geometry.onto_ends(carried)

    def _pushed(self, geometry: PairGeometry, carried: Floats) -> Floats:
        """Pressure force at the points from that of the pairs."""
        if self.law.internal:
            return geometry.onto_ends(carried)
        # as printed in the paper, a pair pushes both of its points the same way
        return -np.stack([geometry.totals(row) for row in carried])

    def majorants(self) -> Majorants:
        # The fluid resists a change of area like a membrane of modulus k times the mass per area.
        modulus = self.law.gas_constant * float(self.masses.sum()) / self.mesh.area
        # Its viscosity resists a uniform rate of stretch as dampers on the edges would.
        geometry, _ = self._fluid(self._rest)
        drag = self.law.viscosity * self._spiky * self._shares * geometry.gap
        edges = float(np.vdot(self._rest.edge_lengths, self._rest.edge_lengths))
        damping = float(np.vdot(drag, geometry.lengths**2)) / edges
        return Majorants(modulus * self.mesh.laplacian, damping * self.mesh.laplacian)

    def rates(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Rates:
        """Bound by the largest block row sum of M⁻¹K and of M⁻¹C."""
        geometry, densities = self._fluid(configuration)
        gap, per_area = geometry.gap, self._spiky * self._shares
        # |∂ρ_i| ≤ 2 slope_i, for moves of at most one
        slope = self._density_change(geometry, self._kernel_slope(geometry.lengths))
        first, second = geometry.at_ends(slope)
        density_part = per_area * gap**2 * self.law.gas_constant * (first + second)
        first, second = geometry.at_ends(slope / densities)
        tension = np.abs(self._mean_pressures) * per_area
        shape_part = tension * gap**2 * (2 * (first + second) + 2 / geometry.lengths)
        shape_part += 4 * tension * gap
        stiffness = self._row_sum(geometry, density_part + shape_part)
        drag = self._row_sum(geometry, 2 * self.law.viscosity * per_area * gap)
        return Rates(stiffness, drag)

    def _row_sum(self, geometry: PairGeometry, values: Floats) -> float:
        return float(np.max(geometry.totals(values) / self.masses))

    def _look(self, positions: Floats) -> PairGeometry:
        """Return what lies between the points at these positions, m, shape (3, n)."""
        pairs = self._neighbours.pairs(positions)
        if self._geometry is None or self._geometry.pairs is not pairs:
            self._geometry = PairGeometry(pairs, len(self.masses), self._radius)
            self._shares, self._mean_pressures = np.empty((2, len(pairs.first)))
        self._geometry.move_to(positions)
        return self._geometry

    def _fluid(self, configuration: Configuration) -> tuple[PairGeometry, Floats]:
        """Work out the fluid: pairs, densities, and in place shares and mean pressures."""
        geometry = self._look(configuration.positions)
        densities = self._densities(geometry)
        first, second = geometry.at_ends(self.masses / densities)
        np.multiply(first, second, out=self._shares)  # m_i m_j/(ρ_i ρ_j)
        first, second = geometry.at_ends(
            0.5 * self.law.gas_constant * (densities - self._rest_densities)
        )
        combine = np.add if self.law.internal else np.subtract
        combine(first, second, out=self._mean_pressures)  # (L_i ± L_j)/2
        return geometry, densities

    def _densities(self, geometry: PairGeometry) -> Floats:
        """ρ_i, kg/m³, eq. 5; a point counts itself."""
        inside = np.multiply(geometry.lengths, geometry.lengths, out=geometry.velocities[0])
        np.subtract(self._radius**2, inside, out=inside)
        np.maximum(inside, 0.0, out=inside)
        np.multiply(inside, inside, out=geometry.weights)
        geometry.weights *= inside  # products: np.power is ten times slower
        density = geometry.neighbour_sum(self._poly6 * self.masses)
        density += self.masses * (self._poly6 * self._radius**6)
        return density

    def _push(self, geometry: PairGeometry) -> Floats:
        """Pressure force of each pair over its length, N/m, positive where the points repel."""
        push: Floats = np.multiply(geometry.gap, geometry.gap, out=geometry.weights)
        push *= self._shares
        push *= self._mean_pressures
        push /= geometry.lengths
        push *= self._spiky
        return push

    def _drag(self, geometry: PairGeometry, velocities: Floats) -> Floats:
        """Viscous force of each pair on its first point, N, shape (3, p)."""
        np.multiply(self._shares, geometry.gap, out=geometry.weights)
        geometry.weights *= self.law.viscosity * self._spiky
        differences = geometry.differences(velocities, geometry.velocities)
        differences *= geometry.weights
        return differences

    def _density_change(self, geometry: PairGeometry, kernel_change: Floats) -> Floats:
        """Σ_j m_j · (a kernel value for each pair)."""
        geometry.weights[:] = kernel_change
        return geometry.neighbour_sum(self.masses)

    def _kernel_slope(self, lengths: Floats) -> Floats:
        """|dW_poly6/dr|."""
        inside: Floats = np.maximum(self._radius**2 - lengths**2, 0.0)
        return 6 * self._poly6 * lengths * inside**2
