"""What a law of force is: parameters first, then bound to a mesh and its masses.

A law is a frozen dataclass with `bind`, and says of itself what integrators and tests have to know.
Bound, it gives the force on each point. A scene that does not name a law never binds it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Generic, NamedTuple, TypeVar

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from softbody_core.configuration import Configuration
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Parameters
from softbody_core.mesh import SurfaceMesh
from softbody_core.state import Inputs
from softbody_core.weights import Control


@dataclass(frozen=True)
class Law(Parameters, ABC):
    """The parameters of a law of force.

    Attributes
    ----------
    control : Control or None
        The control of eq. 1 whose weight the law takes; None for a law outside eq. 1, of weight 1.
    """

    control: ClassVar[Control | None] = None

    @property
    def acts(self) -> bool:
        """Whether the law does anything with its parameters; one that does not is never bound."""
        return True

    @property
    def acts_at_rest(self) -> bool:
        """Whether there is a force on the mesh at rest, without inputs."""
        return False

    @property
    def internal(self) -> bool:
        """Whether the forces on a body that does not turn have no resultant and no torque."""
        return True

    @property
    def objective(self) -> bool:
        """Whether the forces move and turn with the body."""
        return True

    @abstractmethod
    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundLaw[Law]:
        """Prepare the law for one mesh.

        Parameters
        ----------
        mesh : SurfaceMesh
            Surface at rest.
        masses : ndarray, shape (n,)
            Point masses, kg.
        """


class Majorants(NamedTuple):
    """Constant (n, n) operators of the size of a law's stiffness and damping, or larger.

    They are positive semi-definite and act on each component alike; None where a law has none.

    Attributes
    ----------
    stiffness : csr_array, optional
        Of −∂F/∂x, N/m.
    damping : csr_array, optional
        Of −∂F/∂v, N·s/m.
    """

    stiffness: sp.csr_array | None = None
    damping: sp.csr_array | None = None


class Rates(NamedTuple):
    """Upper bounds for an explicit step: spectral radii of M⁻¹K (1/s²) and of M⁻¹C (1/s)."""

    stiffness: float = 0.0
    damping: float = 0.0


LawT_co = TypeVar("LawT_co", bound=Law, covariant=True)


class BoundLaw(ABC, Generic[LawT_co]):
    """A law on one mesh. Nothing here changes the body.

    Attributes
    ----------
    law : Law
        Its parameters.
    mesh : SurfaceMesh
        Surface at rest.
    masses : ndarray, shape (n,)
        Point masses, kg.
    """

    def __init__(self, law: LawT_co, mesh: SurfaceMesh, masses: Floats) -> None:
        self.law = law
        self.mesh = mesh
        self.masses = masses

    @abstractmethod
    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        """Force on each point, N, shape (3, n). Not to be changed; valid until asked again."""

    def energy(self, configuration: Configuration, inputs: Inputs) -> float | None:
        """Potential energy, J, at held inputs; None where the law has none."""
        return None

    def majorants(self) -> Majorants:
        """Operators that implicit integrators factor once; none for a law of small stiffness."""
        return Majorants()

    def rates(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Rates:
        """Bounds on how fast the law makes points move: by default those of its majorants."""
        return self._rates_of_majorants

    @cached_property
    def _rates_of_majorants(self) -> Rates:
        """Largest row sums of M⁻¹K̄ and M⁻¹C̄."""
        sums = (0.0 if m is None else abs(m).sum(axis=1) / self.masses for m in self.majorants())
        return Rates(*(float(np.max(row_sums)) for row_sums in sums))


def largest_eigenvalue(laplacian: sp.csr_array, masses: Floats) -> float:
    """Largest eigenvalue of M⁻¹L for a Laplacian of shape (n, n), rounded up."""
    scale = sp.diags_array(1 / np.sqrt(masses))
    # The highest mode alternates from point to point; any fixed start that is not smooth does.
    start = np.cos(2.4 * np.arange(len(masses)) ** 1.5)
    largest = scipy.sparse.linalg.eigsh(
        scale @ laplacian @ scale, k=1, v0=start, tol=1e-3, return_eigenvectors=False
    )
    return 1.002 * float(largest[0])
