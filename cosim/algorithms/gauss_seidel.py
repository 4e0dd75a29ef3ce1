"""Gauss-Seidel coupling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cosim.algorithms.algorithm import Coupler
from cosim.algorithms.explicit import explicit
from cosim.algorithms.signals import DEGREES, Extrapolation
from cosim.connection import Wiring
from cosim.participant import Participant
from softbody_core.parameters import Parameters


@dataclass(frozen=True)
class GaussSeidel(Parameters):
    """One after the other, in the order given: each sees what those before it have just computed.

    With the controller first, a body feels the controller's answer to the volume that it has now.

    Parameters
    ----------
    extrapolation : str
        How continuous outputs go on over a step: "constant", "linear" or "quadratic".
    """

    extrapolation: Extrapolation = "constant"

    @property
    def order(self) -> int:
        """One more than the degree of the extrapolation."""
        return DEGREES[self.extrapolation] + 1

    def bind(self, participants: Sequence[Participant], wiring: Wiring) -> Coupler:
        """Get ready to carry these participants."""
        return explicit(participants, wiring, self.extrapolation, in_turn=True)
