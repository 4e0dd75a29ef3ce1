"""Volume control: pressure on the inside of the wall (Mesit & Guha 2011, eq. 10)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
import scipy.sparse as sp

from softbody_core.configuration import Configuration, norms
from softbody_core.forces.force import BoundForce, RankOne, Rates, Tangent, blocks
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.mesh import SurfaceMesh
from softbody_core.state import Inputs
from softbody_core.weights import Control


@dataclass(frozen=True)
class InternalPressure(Parameters):
    """Gas pressure and driven pressure, along the outward area vectors.

    F_i = (κ N / B + ΔP) ∂V/∂x_i

    "I/B" has no I in the text of the paper; here the gas pressure is κN/B. The area share of a
    point is a third of each of its triangles, which makes F_i exactly the gradient of the volume.

    Parameters
    ----------
    gas_energy : float
        κ, energy per unit of N, J.
    over : {"bounding-box", "enclosed-volume"}
        Volume B that the gas fills: that of the axis-aligned bounding box, as in the paper, or the
        enclosed one. The box is not objective: it changes as a body turns.
    area_share : {"third", "whole"}
        ``"whole"`` is the literal reading of eq. 10 and pushes three times as hard.
    """

    control: ClassVar[Control | None] = Control.VOLUME

    gas_energy: Annotated[float, Quantity("J", at_least=0)]
    over: Literal["bounding-box", "enclosed-volume"] = "bounding-box"
    area_share: Literal["third", "whole"] = "third"

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundPressure:
        """Fill the surface."""
        return BoundPressure(self, mesh, masses)

    @property
    def share(self) -> float:
        """Area that a point feels, as a multiple of ∂V/∂x."""
        return 1.0 if self.area_share == "third" else 3.0

    def pressure(self, gas_volume: float, inputs: Inputs) -> float:
        """κN/B + ΔP, Pa, where the gas fills the volume B, m³."""
        gas = self.gas_energy * inputs.n
        if gas_volume > 0:
            return gas / gas_volume + inputs.delta_p
        return np.inf if gas > 0 else inputs.delta_p

    def gas_volume(self, configuration: Configuration) -> float:
        """B, the volume that the gas fills, m³."""
        if self.over == "bounding-box":
            return configuration.bounding_box_volume
        return configuration.volume


class BoundPressure(BoundForce):
    """Pressure inside one surface."""

    def __init__(self, law: InternalPressure, mesh: SurfaceMesh, masses: Floats) -> None:
        self.law = law
        self._share = law.share
        self._mesh = mesh
        self._masses = masses

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        pressure = self._pressure(configuration, inputs)
        return (self._share * pressure) * configuration.volume_gradient

    def _pressure(self, configuration: Configuration, inputs: Inputs) -> float:
        """κN/B + ΔP, Pa; without gas, nothing asks for B."""
        gas = self.law.gas_energy * inputs.n > 0
        return self.law.pressure(self.law.gas_volume(configuration) if gas else np.inf, inputs)

    def energy(self, configuration: Configuration, inputs: Inputs) -> float | None:
        driven = -inputs.delta_p * configuration.volume
        if inputs.n == 0:
            return self._share * driven
        if self.law.over == "bounding-box":  # its force is no gradient: B is not the volume pushed
            return None
        gas = -self.law.gas_energy * inputs.n * np.log(configuration.volume)
        return self._share * float(gas + driven)

    def stiffness(self, configuration: Configuration, inputs: Inputs) -> Tangent:
        pressure = self._pressure(configuration, inputs)
        return Tangent(
            sparse=-self._share * pressure * self._area_curvature(configuration),
            rank_one=self.rank_one_stiffness(configuration, inputs),
        )

    def rates(self, configuration: Configuration, inputs: Inputs) -> Rates:
        # Block row sums of ∂A/∂x, whose block for edge (i, j) with wings a, b is [x_a − x_b]×/6.
        wings = norms(
            configuration.positions[:, self._mesh.edge_wings[:, 0]]
            - configuration.positions[:, self._mesh.edge_wings[:, 1]]
        )
        ends = self._mesh.edges
        row_sums = np.bincount(ends.ravel(), np.repeat(wings / 6, 2), len(self._masses))
        pressure = self._share * abs(self._pressure(configuration, inputs))
        bound = pressure * float(np.max(row_sums / self._masses))
        for coefficient, left, right in self.rank_one_stiffness(configuration, inputs):
            sizes = (np.linalg.norm(v / np.sqrt(self._masses)) for v in (left, right))
            bound += coefficient * float(np.prod(list(sizes)))
        return Rates(stiffness=bound)

    def rank_one_stiffness(
        self, configuration: Configuration, inputs: Inputs
    ) -> tuple[RankOne, ...]:
        """−A ∂p/∂x: the gas stiffens as it is squeezed."""
        if self.law.gas_energy * inputs.n == 0:
            return ()
        gas_volume = self.law.gas_volume(configuration)
        gradient = (
            configuration.bounding_box_gradient
            if self.law.over == "bounding-box"
            else configuration.volume_gradient
        )
        slope = self._share * self.law.gas_energy * inputs.n / gas_volume**2
        return (RankOne(slope, configuration.volume_gradient, gradient),)

    def _area_curvature(self, configuration: Configuration) -> sp.csr_array:
        """∂A/∂x = ∂²V/∂x², shape (3n, 3n): a third of ½[e_b]× from each triangle at b."""
        triangles = self._mesh.triangles
        n = self._mesh.n_points
        rows, columns = np.repeat(triangles, 3, axis=1).ravel(), np.tile(triangles, 3).ravel()
        corner = configuration.positions[:, triangles]
        opposite = corner[:, :, [2, 0, 1]] - corner[:, :, [1, 2, 0]]
        entries = np.tile(opposite, 3).reshape(3, -1) / 6

        def matrix(values: Floats) -> sp.csr_array:
            return sp.csr_array((values, (rows, columns)), shape=(n, n))

        empty = sp.csr_array((n, n))
        x, y, z = (matrix(entries[axis]) for axis in range(3))
        cross = [[empty, -z, y], [z, empty, -x], [-y, x, empty]]
        return blocks(lambda row, column: cross[row][column])
