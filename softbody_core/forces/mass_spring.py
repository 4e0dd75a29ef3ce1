"""Body structure control: a mass-spring network on the edges (Mesit & Guha 2011, eqs 2-4)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
import scipy.sparse as sp

from softbody_core.configuration import Configuration, scatter
from softbody_core.forces.force import BoundForce, Rates, Tangent, blocks, largest_eigenvalue
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.mesh import SurfaceMesh, per_component
from softbody_core.state import Inputs
from softbody_core.weights import Control

_TINY = np.finfo(np.float64).tiny
"""Stands for a length of zero, so that a direction without length becomes zero."""


@dataclass(frozen=True)
class MassSpring(Parameters):
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

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundForce:
        """Attach a spring and a damper to each edge, at rest as the mesh stands."""
        return _BoundMassSpring(self, mesh, masses)


class _BoundMassSpring(BoundForce):
    def __init__(self, law: MassSpring, mesh: SurfaceMesh, masses: Floats) -> None:
        self._law = law
        self._masses = masses
        self._rest_lengths = mesh.edge_lengths
        self._difference = mesh.edge_difference
        self._gather = mesh.edge_difference.T.tocsr()
        self._laplacian = mesh.laplacian
        self._pull = per_component(-self._gather)
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
        return 0.5 * self._law.stiffness * float(stretch @ stretch)

    def stiffness(self, configuration: Configuration, inputs: Inputs) -> Tangent:
        along = configuration.edge_vectors / np.maximum(configuration.edge_lengths, _TINY)
        across = self._tension_over_length(configuration)
        axial = self._law.stiffness - across

        def block(row: int, column: int) -> sp.csr_array:
            weights = axial * along[row] * along[column]
            if row == column:
                weights += across
            return sp.csr_array(self._gather @ sp.diags_array(weights) @ self._difference)

        return Tangent(sparse=blocks(block))

    def damping(self, configuration: Configuration) -> Tangent:
        return Tangent(sparse=self._dampers)

    def bounding_operators(self) -> tuple[sp.csr_array, sp.csr_array]:
        # Across a spring the stiffness is k_s (1 − l⁰/l): negative where it is compressed, and
        # never more than the k_s of the Laplacian, which is positive semi-definite.
        return self._law.stiffness * self._laplacian, self._law.damping * self._laplacian

    def rates(self, configuration: Configuration, inputs: Inputs) -> Rates:
        # An edge's stiffness is k_s along it and k_s (1 − l⁰/l) < k_s across it, so the Laplacian
        # bounds the network in every configuration.
        return Rates(
            self._law.stiffness * self._largest_laplacian_eigenvalue,
            self._law.damping * self._largest_laplacian_eigenvalue,
        )

    @cached_property
    def _largest_laplacian_eigenvalue(self) -> float:
        return largest_eigenvalue(self._laplacian, self._masses)

    def _tension_over_length(self, configuration: Configuration) -> Floats:
        """k_s (1 − l⁰/l), N/m, shape (m,); an edge of no length pulls nowhere."""
        tension = np.maximum(configuration.edge_lengths, _TINY, out=self._tension)
        np.divide(self._rest_lengths, tension, out=tension)
        np.subtract(1.0, tension, out=tension)
        tension *= self._law.stiffness
        return tension
