"""Body structure control: a mass-spring network on the edges (Mesit & Guha 2011, eqs 2-4)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np

from softbody_core.configuration import Configuration, scatter
from softbody_core.forces.law import BoundLaw, Law, Majorants, Rates, largest_eigenvalue
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Quantity
from softbody_core.mesh import SurfaceMesh, per_component
from softbody_core.state import Inputs
from softbody_core.weights import Control

_TINY = np.finfo(np.float64).tiny
"""Stands for a length of zero, so that a direction without length becomes zero."""


@dataclass(frozen=True)
class MassSpring(Law):
    """Springs and dampers along the edges of the surface.

    F_i = Σ_j k_s (l_ij − l⁰_ij) (x_j − x_i)/l_ij + k_d (v_j − v_i)

    Eq. 4 is printed with k_d·h·(v_i − v_j), which feeds energy in and depends on the step size h;
    here the sign is that of a damper and the factor h is left out.

    Parameters
    ----------
    stiffness : float
        k_s, N/m. A triangular net of such springs is a membrane whose modulus lies between
        (√3/2) k_s and (2/√3) k_s whatever its edge length.
    damping : float
        k_d, N·s/m.
    """

    control: ClassVar[Control | None] = Control.STRUCTURE

    stiffness: Annotated[float, Quantity("N/m", at_least=0)]
    damping: Annotated[float, Quantity("N.s/m", at_least=0)] = 0.0

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundLaw[Law]:
        """Attach a spring and a damper to each edge, at rest as the mesh stands."""
        return _BoundMassSpring(self, mesh, masses)


class _BoundMassSpring(BoundLaw[MassSpring]):
    def __init__(self, law: MassSpring, mesh: SurfaceMesh, masses: Floats) -> None:
        super().__init__(law, mesh, masses)
        self._rest_lengths = mesh.edge_lengths
        self._pull = per_component(-mesh.edge_difference.T.tocsr())
        self._dampers = per_component(law.damping * mesh.laplacian) if law.damping else None
        self._tension = np.empty(len(self._rest_lengths))
        self._tensions = np.empty((3, len(self._rest_lengths)))

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        tension = self._tension_over_length(configuration)
        np.multiply(tension, configuration.edge_vectors, out=self._tensions)
        force = scatter(self._pull, self._tensions)
        if self._dampers is not None:
            force -= scatter(self._dampers, velocities)
        return force

    def energy(self, configuration: Configuration, inputs: Inputs) -> float:
        stretch = configuration.edge_lengths - self._rest_lengths
        return 0.5 * self.law.stiffness * float(stretch @ stretch)

    def majorants(self) -> Majorants:
        # Across a spring the stiffness is k_s (1 − l⁰/l): negative where it is compressed, and
        # never more than the k_s of the Laplacian, which is positive semi-definite.
        laplacian = self.mesh.laplacian
        return Majorants(self.law.stiffness * laplacian, self.law.damping * laplacian)

    def rates(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Rates:
        # An edge's stiffness is k_s along it and k_s (1 − l⁰/l) < k_s across it, so the Laplacian
        # bounds the network in every configuration.
        return Rates(
            self.law.stiffness * self._largest_laplacian_eigenvalue,
            self.law.damping * self._largest_laplacian_eigenvalue,
        )

    @cached_property
    def _largest_laplacian_eigenvalue(self) -> float:
        return largest_eigenvalue(self.mesh.laplacian, self.masses)

    def _tension_over_length(self, configuration: Configuration) -> Floats:
        """k_s (1 − l⁰/l), N/m, shape (m,); an edge of no length pulls nowhere."""
        tension = np.maximum(configuration.edge_lengths, _TINY, out=self._tension)
        np.divide(self._rest_lengths, tension, out=tension)
        np.subtract(1.0, tension, out=tension)
        tension *= self.law.stiffness
        return tension
