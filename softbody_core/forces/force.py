"""What a force is: parameters first, then bound to a mesh and its masses.

A law is a frozen `Parameters` dataclass with `bind`. Bound, it is a `BoundForce`, whose methods
take the moment at which the body stands. A scene that does not name a law never binds it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple, Protocol

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from softbody_core.configuration import Configuration
from softbody_core.ground.arrays import Floats
from softbody_core.mesh import SurfaceMesh
from softbody_core.state import Inputs
from softbody_core.weights import Control


class RankOne(NamedTuple):
    """The matrix coefficient · left rightᵀ; both vectors have shape (3, n)."""

    coefficient: float
    left: Floats
    right: Floats


@dataclass(frozen=True)
class Tangent:
    """A matrix −∂F/∂x (stiffness, N/m) or −∂F/∂v (damping, N·s/m), as a sum of parts.

    Rows and columns are ordered component by component, like a ravelled (3, n) array.

    Attributes
    ----------
    sparse : csr_array, shape (3n, 3n), or None
        The part with entries among neighbours.
    operator : callable or None
        A part that is only known by its product with a (3, n) array.
    rank_one : tuple of RankOne
        The parts that couple every point with every other.
    """

    sparse: sp.csr_array | None = None
    operator: Callable[[Floats], Floats] | None = None
    rank_one: tuple[RankOne, ...] = field(default=())

    def __matmul__(self, direction: Floats) -> Floats:
        """Product with a direction of shape (3, n)."""
        product = np.zeros_like(direction)
        if self.sparse is not None:
            product += (self.sparse @ direction.ravel()).reshape(direction.shape)
        if self.operator is not None:
            product += self.operator(direction)
        for coefficient, left, right in self.rank_one:
            product += coefficient * np.vdot(right, direction) * left
        return product


class Rates(NamedTuple):
    """Upper bounds for an explicit step: spectral radii of M⁻¹K (1/s²) and of M⁻¹C (1/s)."""

    stiffness: float = 0.0
    damping: float = 0.0


class BoundForce(ABC):
    """A force law on one mesh. Nothing here changes the body."""

    @abstractmethod
    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        """Force on each point, N, shape (3, n). Not to be changed; valid until asked again."""

    def energy(self, configuration: Configuration, inputs: Inputs) -> float | None:
        """Potential energy, J, at held inputs; None where the law has none."""
        return None

    def stiffness(self, configuration: Configuration, inputs: Inputs) -> Tangent:
        """−∂F/∂x of the body at rest in this configuration."""
        return Tangent()

    def damping(self, configuration: Configuration) -> Tangent:
        """−∂F/∂v."""
        return Tangent()

    def rank_one_stiffness(
        self, configuration: Configuration, inputs: Inputs
    ) -> tuple[RankOne, ...]:
        """Parts of the stiffness that couple every point with every other."""
        return ()

    def rank_one_damping(self, configuration: Configuration) -> tuple[RankOne, ...]:
        """Parts of the damping that couple every point with every other."""
        return ()

    def bounding_operators(self) -> tuple[sp.csr_array, sp.csr_array] | None:
        """Constant (n, n) operators of the size of the stiffness and the damping, or larger.

        They are positive semi-definite and act on each component alike; implicit schemes factor
        them once. None for a law whose sparse part is small.
        """
        return None

    def rates(self, configuration: Configuration, inputs: Inputs) -> Rates:
        """Bounds on how fast the law makes points move."""
        return Rates()


class Force(Protocol):
    """The parameters of a force law.

    Attributes
    ----------
    control : Control or None
        The control of eq. 1 whose weight the law takes; None for a law outside eq. 1, of weight 1.
    """

    control: ClassVar[Control | None]

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundForce:
        """Prepare the law for one mesh.

        Parameters
        ----------
        mesh : SurfaceMesh
            Surface at rest.
        masses : ndarray, shape (n,)
            Point masses, kg.
        """
        ...


def blocks(operator: Callable[[int, int], sp.csr_array | None]) -> sp.csr_array:
    """Assemble a (3n, 3n) matrix from its nine component blocks."""
    rows = [[operator(row, column) for column in range(3)] for row in range(3)]
    return sp.block_array(rows, format="csr")


def largest_eigenvalue(laplacian: sp.csr_array, masses: Floats) -> float:
    """Largest eigenvalue of M⁻¹L for a Laplacian of shape (n, n), rounded up."""
    scale = sp.diags_array(1 / np.sqrt(masses))
    # The highest mode alternates from point to point; any fixed start that is not smooth does.
    start = np.cos(2.4 * np.arange(len(masses)) ** 1.5)
    largest = scipy.sparse.linalg.eigsh(
        scale @ laplacian @ scale, k=1, v0=start, tol=1e-3, return_eigenvectors=False
    )
    return 1.002 * float(largest[0])
