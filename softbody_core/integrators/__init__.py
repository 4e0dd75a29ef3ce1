"""The integration schemes, one a file, and the table of them.

A new scheme is one file here and one line in `INTEGRATORS`.
"""

from __future__ import annotations

from typing import Final

from softbody_core.integrators.integrator import Integrator, Stepper, Work
from softbody_core.integrators.rk4 import RK4
from softbody_core.integrators.sdirk2 import SDIRK2
from softbody_core.integrators.symplectic_euler import SymplecticEuler
from softbody_core.integrators.velocity_verlet import VelocityVerlet

INTEGRATORS: Final[dict[str, type[Integrator]]] = {
    "symplectic-euler": SymplecticEuler,
    "velocity-verlet": VelocityVerlet,
    "rk4": RK4,
    "sdirk2": SDIRK2,
}

__all__ = [
    "INTEGRATORS",
    "RK4",
    "SDIRK2",
    "Integrator",
    "Stepper",
    "SymplecticEuler",
    "VelocityVerlet",
    "Work",
]
