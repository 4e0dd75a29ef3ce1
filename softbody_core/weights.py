"""The four weights that mix the forces (Mesit & Guha 2011, eq. 1)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated

from softbody_core.ground.parameters import Parameters, Quantity


class Control(Enum):
    """The paper's word for the role of a force, with the name of its weight."""

    STRUCTURE = "alpha"
    ANAMORPHOSIS = "beta"
    VOLUME = "gamma"
    GRAVITY = "delta"


@dataclass(frozen=True)
class Weights(Parameters):
    """F_i = α F_b + β F_a + γ F_v + δ F_g, with α > 0 and β, γ, δ ≥ 0.

    Parameters
    ----------
    alpha, beta, gamma, delta : float
        Weights of body structure, anamorphosis, volume control and gravity.
    """

    alpha: Annotated[float, Quantity("1", above=0)] = 1.0
    beta: Annotated[float, Quantity("1", at_least=0)] = 1.0
    gamma: Annotated[float, Quantity("1", at_least=0)] = 1.0
    delta: Annotated[float, Quantity("1", at_least=0)] = 1.0

    def of(self, control: Control | None) -> float:
        """Weight of a control; 1 for a law outside eq. 1."""
        return 1.0 if control is None else float(getattr(self, control.value))
