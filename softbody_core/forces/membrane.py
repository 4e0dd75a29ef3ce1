"""Body structure control by finite elements: a membrane of constant-strain triangles.

Within a triangle the Green strain is linear in the squares of its edges' lengths, so the membrane
can be written on the edges, as the springs are (Delingette 2008, "Triangular springs for modeling
nonlinear membranes", IEEE TVCG 14(2), 329-341).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
import scipy.sparse as sp

from softbody_core.configuration import Configuration, scatter
from softbody_core.forces.law import BoundLaw, Law, Majorants, Rates, largest_eigenvalue
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Quantity
from softbody_core.mesh import SurfaceMesh, per_component
from softbody_core.state import Inputs
from softbody_core.weights import Control

_STRETCHED = 2.0
"""Stiffness of the majorant over that at rest.

The law stiffens with the square of the stretch. An iteration converges where its matrix is at least
half the exact one: up to a stretch of √3 with this value, five times the volume. Beyond, and for a
larger margin, there is Anderson acceleration, and then shorter steps.
"""


@dataclass(frozen=True)
class Membrane(Law):
    """St. Venant-Kirchhoff membrane in plane stress, with dampers along the edges.

    U = ½ Σ A⁰ E : S,  S = Y/(1 − ν²) [(1 − ν) E + ν tr(E) I]

    over the triangles, of area A⁰ at rest; E is the Green strain, S the second Piola-Kirchhoff
    stress. On the edges, with q = (l² − l⁰²)/2 and K, which joins the edges of each triangle,

    U = ½ qᵀ K q,  t = K q,  F_i = Σ_j t_ij (x_j − x_i) + k_d (v_j − v_i).

    The law stiffens under tension and yields when squeezed: at size zero it is free of force. The
    dampers are those of `MassSpring`, so that one law can stand in for the other. A viscous stress
    would not see motion across the surface, and would leave it crumpling.

    Parameters
    ----------
    stiffness : float
        Y, Young's modulus times thickness, N/m. A triangular net of springs k_s is a membrane with
        Y = (2/√3) k_s and ν = 1/3 for small strains.
    poisson_ratio : float
        ν; ½ for a thin sheet of an incompressible solid.
    damping : float
        k_d, N·s/m.
    """

    control: ClassVar[Control | None] = Control.STRUCTURE

    stiffness: Annotated[float, Quantity("N/m", at_least=0)]
    poisson_ratio: Annotated[float, Quantity("1", above=-1, below=1)] = 1 / 3
    damping: Annotated[float, Quantity("N.s/m", at_least=0)] = 0.0

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundLaw[Law]:
        """Spread the membrane over the triangles, at rest as the mesh stands."""
        return _BoundMembrane(self, mesh, masses)


class _BoundMembrane(BoundLaw[Membrane]):
    def __init__(self, law: Membrane, mesh: SurfaceMesh, masses: Floats) -> None:
        super().__init__(law, mesh, masses)
        self._rest_squares = mesh.edge_lengths**2
        self._difference = mesh.edge_difference
        self._gather = mesh.edge_difference.T.tocsr()
        self._pull = per_component(-self._gather)
        self._dampers = per_component(law.damping * mesh.laplacian) if law.damping else None
        self._strain_of, areas = _strain_operators(mesh)
        self._joined = _joined(mesh, self._strain_of, areas, law)
        self._tensions = np.empty((3, len(mesh.edges)))

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        tension = self._joined @ self._stretch(configuration)
        np.multiply(tension, configuration.edge_vectors, out=self._tensions)
        force = scatter(self._pull, self._tensions)
        if self._dampers is not None:
            force -= scatter(self._dampers, velocities)
        return force

    def energy(self, configuration: Configuration, inputs: Inputs) -> float:
        stretch = self._stretch(configuration)
        return 0.5 * float(stretch @ (self._joined @ stretch))

    def majorants(self) -> Majorants:
        modulus = _STRETCHED * self.law.stiffness / (1 - abs(self.law.poisson_ratio))
        return Majorants(modulus * self._laplacian, self.law.damping * self.mesh.laplacian)

    def rates(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Rates:
        # A move u changes E by sym(Fᵀ∇u), so |dE| ≤ |F||∇u|, and the stress acts on ∇uᵀ∇u/2. The
        # largest factor of S = C E is Y/(1 − |ν|). The Laplacian is that of ∫|∇u|².
        young, poisson = self.law.stiffness, self.law.poisson_ratio
        stretch_of = self._stretch(configuration)[self.mesh.triangle_edges]
        xx, yy, xy = np.einsum("tsq,tq->st", self._strain_of, stretch_of)
        mean, deviation = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy / 2)
        squared = 1 + 2 * (mean + deviation)  # largest eigenvalue of FᵀF
        stress = young * np.maximum(mean / (1 - poisson) + deviation / (1 + poisson), 0)
        modulus = float(np.max(young / (1 - abs(poisson)) * squared + stress))
        damping = self.law.damping
        return Rates(modulus * self._fastest, damping * self._fastest_damped if damping else 0.0)

    def _stretch(self, configuration: Configuration) -> Floats:
        """Return q = (l² − l⁰²)/2 of each edge, m², shape (m,)."""
        lengths = configuration.edge_lengths
        squares = lengths * lengths
        squares -= self._rest_squares
        squares *= 0.5
        return squares

    @cached_property
    def _laplacian(self) -> sp.csr_array:
        """∫ ∇φ_i · ∇φ_j over the surface at rest: the cotangent Laplacian, shape (n, n)."""
        sides, areas = _rest_sides(self.mesh)
        # an edge gets −a·b/4A from the other two sides of each triangle: half a cotangent
        products = np.einsum("tkc,tkc->tk", sides[:, [1, 2, 0]], sides[:, [2, 0, 1]])
        weights = np.bincount(
            self.mesh.triangle_edges.ravel(), (-products / (4 * areas[:, None])).ravel()
        )
        return sp.csr_array(self._gather @ sp.diags_array(weights) @ self._difference)

    @cached_property
    def _fastest(self) -> float:
        return largest_eigenvalue(self._laplacian, self.masses)

    @cached_property
    def _fastest_damped(self) -> float:
        return largest_eigenvalue(self.mesh.laplacian, self.masses)


def _rest_sides(mesh: SurfaceMesh) -> tuple[Floats, Floats]:
    """Sides of the triangles at rest, m, shape (t, 3, 3), and their areas, m², shape (t,)."""
    corners = mesh.points[mesh.triangles]
    sides = corners[:, [1, 2, 0]] - corners
    return sides, np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2


def _strain_operators(mesh: SurfaceMesh) -> tuple[Floats, Floats]:
    """(E_xx, E_yy, 2 E_xy) of each triangle per q of its sides, shape (t, 3, 3), and the areas.

    A side a at rest has q = aᵀ E a: three equations for the three components.
    """
    sides, areas = _rest_sides(mesh)
    first = sides[:, 0] / np.linalg.norm(sides[:, 0], axis=1)[:, None]
    x = np.einsum("tkc,tc->tk", sides, first)
    y = np.array([0, 1, -1]) * (2 * areas / x[:, 0])[:, None]  # the height over the first side
    return np.linalg.inv(np.stack([x * x, y * y, x * y], axis=2)), areas


def _joined(mesh: SurfaceMesh, strain_of: Floats, areas: Floats, law: Membrane) -> sp.csr_array:
    """K = Σ A⁰ Qᵀ C Q over the triangles, with strains Q q and stresses C E, N/m³, shape (m, m)."""
    nu = law.poisson_ratio
    elastic = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    elastic *= law.stiffness / (1 - nu**2)
    entries = areas[:, None, None] * (strain_of.transpose(0, 2, 1) @ elastic @ strain_of)
    edges, m = mesh.triangle_edges, len(mesh.edges)
    rows, columns = np.repeat(edges, 3, axis=1), np.tile(edges, 3)
    return sp.csr_array((entries.ravel(), (rows.ravel(), columns.ravel())), shape=(m, m))
