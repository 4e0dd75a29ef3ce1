"""Anamorphosis control: a fluid among the surface points (Mesit & Guha 2011, eqs 5-9).

Kernels: Müller, Charypar & Gross 2003, "Particle-based fluid simulation for interactive
applications", eqs 20-22.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from softbody_core.configuration import Configuration, norms, pair_differences, scatter
from softbody_core.forces.force import BoundForce, Rates, Tangent
from softbody_core.mesh import SurfaceMesh
from softbody_core.neighbours import NeighbourList, Pairs
from softbody_core.parameters import Parameters, Quantity
from softbody_core.state import Inputs
from softbody_core.weights import Control

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SurfaceSPH(Parameters):
    """Smoothed particle hydrodynamics among surface points within the core radius h_w.

    ρ_i = Σ_j m_j W_poly6(r_ij),  L_i = k (ρ_i − ρ⁰_i)

    F_i = Σ_j m_i m_j/(ρ_i ρ_j) [−(L_i + L_j)/2 ∇W_spiky + μ (v_j − v_i) ∇²W_viscosity]

    Eq. 7 is printed with L_i − L_j; only the sum, as in Müller et al. 2003, conserves momentum.
    Eqs 7 and 8 are force densities; times m_i/ρ_i they are newtons. The initial density ρ⁰ of
    eq. 6 is each point's own, so that the body rests in its rest shape.

    Parameters
    ----------
    gas_constant : float
        k, m²/s².
    viscosity : float
        μ, Pa·s.
    core_radius : float
        h_w in mean edge lengths of the surface at rest.
    pressure : {"sum", "difference"}
        ``"difference"`` is eq. 7 as printed.
    """

    control: ClassVar[Control | None] = Control.ANAMORPHOSIS

    gas_constant: Annotated[float, Quantity("m^2/s^2", at_least=0)]
    viscosity: Annotated[float, Quantity("Pa.s", at_least=0)] = 0.0
    core_radius: Annotated[float, Quantity("1", above=0)] = 2.0
    pressure: Literal["sum", "difference"] = "sum"

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundForce:
        """Find neighbours and densities at rest."""
        return _BoundSPH(self, mesh, masses)


class _Fluid(NamedTuple):
    """Pairs, and what the fluid equations say at one configuration."""

    pairs: Pairs
    vectors: Floats  # x_j − x_i, (3, p)
    lengths: Floats  # r, (p,)
    gap: Floats  # h_w − r, never below 0, (p,)
    shares: Floats  # m_i m_j/(ρ_i ρ_j), (p,)
    densities: Floats  # (n,)
    mean_pressure: Floats  # (L_i ± L_j)/2, (p,)


class _BoundSPH(BoundForce):
    def __init__(self, law: SurfaceSPH, mesh: SurfaceMesh, masses: Floats) -> None:
        self._law = law
        self._masses = masses
        self._area = mesh.area
        self._laplacian = mesh.laplacian
        self._radius = h = law.core_radius * float(mesh.edge_lengths.mean())
        self._neighbours = NeighbourList(h)
        self._poly6 = 315 / (64 * np.pi * h**9)  # W = poly6 (h² − r²)³
        self._spiky = 45 / (np.pi * h**6)  # −∇W = spiky (h − r)² r̂, ∇²W_viscosity = spiky (h − r)
        self._sign = 1.0 if law.pressure == "sum" else -1.0
        rest = np.ascontiguousarray(mesh.points.T)
        pairs = self._neighbours.pairs(rest)
        lengths = norms(_over(rest, pairs))
        self._rest_densities = self._density(pairs, lengths)

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        fluid = self._fluid(configuration)
        push = self._push(fluid)
        if self._law.pressure == "difference":  # eq. 7 as printed: both ends feel the same
            ends = fluid.pairs
            force = scatter(ends.to_first + ends.to_second, -push * fluid.vectors)
            push = np.zeros_like(push)
        else:
            force = np.zeros_like(configuration.positions)
        along = push * fluid.vectors
        if self._law.viscosity:
            along -= self._drag(fluid) * _over(velocities, fluid.pairs)
        force += scatter(fluid.pairs.gather_difference, along)
        return force

    def stiffness(self, configuration: Configuration, inputs: Inputs) -> Tangent:
        return Tangent(operator=lambda u: -self._force_change(configuration, u))

    def damping(self, configuration: Configuration) -> Tangent:
        fluid = self._fluid(configuration)
        drag = self._drag(fluid)

        def product(u: Floats) -> Floats:
            return scatter(fluid.pairs.gather_difference, drag * _over(u, fluid.pairs))

        return Tangent(operator=product)

    def bounding_operators(self) -> tuple[sp.csr_array, sp.csr_array]:
        # The fluid resists a change of area like a membrane of modulus k times the mass per area.
        modulus = self._law.gas_constant * float(self._masses.sum()) / self._area
        return modulus * self._laplacian, sp.csr_array(self._laplacian.shape)

    def rates(self, configuration: Configuration, inputs: Inputs) -> Rates:
        """Bound by the largest block row sum of M⁻¹K and of M⁻¹C."""
        fluid, law = self._fluid(configuration), self._law
        pairs, gap = fluid.pairs, fluid.gap
        per_area = fluid.shares * self._spiky
        # |∂ρ_i| ≤ 2 slope_i, for moves of at most one
        slope = self._density_change(pairs, self._kernel_slope(fluid.lengths))
        ends = slope[pairs.first] + slope[pairs.second]
        density_part = per_area * gap**2 * law.gas_constant * ends
        tension = np.abs(fluid.mean_pressure) * per_area
        relative = slope / fluid.densities
        shape_part = (
            tension
            * gap**2
            * (2 * (relative[pairs.first] + relative[pairs.second]) + 2 / self._separation(fluid))
            + 4 * tension * gap
        )
        stiffness = self._row_sum(pairs, density_part + shape_part)
        drag = self._row_sum(pairs, 2 * law.viscosity * per_area * gap)
        return Rates(stiffness, drag)

    def _row_sum(self, pairs: Pairs, values: Floats) -> float:
        rows = pairs.to_first @ values + pairs.to_second @ values
        return float(np.max(rows / self._masses))

    def _fluid(self, configuration: Configuration) -> _Fluid:
        pairs = self._neighbours.pairs(configuration.positions)
        vectors = _over(configuration.positions, pairs)
        lengths = norms(vectors)
        gap = np.maximum(self._radius - lengths, 0.0)
        densities = self._density(pairs, lengths)
        pressures = self._law.gas_constant * (densities - self._rest_densities)
        volumes = self._masses / densities
        shares = volumes[pairs.first] * volumes[pairs.second]
        mean = 0.5 * (pressures[pairs.first] + self._sign * pressures[pairs.second])
        return _Fluid(pairs, vectors, lengths, gap, shares, densities, mean)

    def _push(self, fluid: _Fluid) -> Floats:
        """Pressure force of each pair over its length, N/m, positive where the points repel."""
        push = fluid.shares * fluid.mean_pressure * self._spiky * fluid.gap**2
        push /= self._separation(fluid)
        return push

    def _drag(self, fluid: _Fluid) -> Floats:
        """Viscous force of each pair over its difference of velocity, N·s/m."""
        drag: Floats = self._law.viscosity * self._spiky * fluid.shares * fluid.gap
        return drag

    def _separation(self, fluid: _Fluid) -> Floats:
        """Lengths, kept above zero: points at one place push each other nowhere."""
        return np.maximum(fluid.lengths, np.finfo(np.float64).tiny)

    def _density(self, pairs: Pairs, lengths: Floats) -> Floats:
        """ρ_i, kg/m³, eq. 5; a point counts itself."""
        inside = np.maximum(self._radius**2 - lengths * lengths, 0.0)
        kernel = self._poly6 * (inside * inside * inside)  # a product: np.power is ten times slower
        density = self._density_change(pairs, kernel)
        density += self._masses * (self._poly6 * self._radius**6)
        return density

    def _density_change(self, pairs: Pairs, kernel: Floats) -> Floats:
        """Σ_j m_j · (a kernel value for each pair)."""
        change: Floats = pairs.to_first @ (self._masses[pairs.second] * kernel)
        change += pairs.to_second @ (self._masses[pairs.first] * kernel)
        return change

    def _kernel_slope(self, lengths: Floats) -> Floats:
        """|dW_poly6/dr|."""
        gap: Floats = np.maximum(self._radius**2 - lengths**2, 0.0)
        return 6 * self._poly6 * lengths * gap**2

    def _force_change(self, configuration: Configuration, u: Floats) -> Floats:
        """(∂F/∂x) u of the pressure force."""
        fluid = self._fluid(configuration)
        pairs, gap, lengths = fluid.pairs, fluid.gap, self._separation(fluid)
        du = _over(u, pairs)
        dr = np.einsum("cp,cp->p", fluid.vectors, du) / lengths
        d_density = self._density_change(pairs, -self._kernel_slope(fluid.lengths) * dr)
        relative = d_density / fluid.densities
        # push = shares · mean · spiky · gap² / r, differentiated factor by factor
        d_mean = (
            0.5
            * self._law.gas_constant
            * (d_density[pairs.first] + self._sign * d_density[pairs.second])
        )
        push = self._push(fluid)
        d_push = fluid.shares * d_mean * self._spiky * gap**2 / lengths
        d_push -= push * (relative[pairs.first] + relative[pairs.second] + dr / lengths)
        d_push -= 2 * fluid.shares * fluid.mean_pressure * self._spiky * gap * dr / lengths
        change = d_push * fluid.vectors + push * du
        if self._law.pressure == "difference":
            return scatter(pairs.to_first + pairs.to_second, -change)
        return scatter(pairs.gather_difference, change)


def _over(values: Floats, pairs: Pairs) -> Floats:
    return pair_differences(values, pairs.first, pairs.second)
