"""The integrators, one a file, and the table of them.

A new integrator is one file here and one line in `INTEGRATORS`.
"""

from __future__ import annotations

from typing import Final

from softbody_core.integrators.backward_euler import BackwardEuler
from softbody_core.integrators.bdf2 import BDF2
from softbody_core.integrators.integrator import Counters, Integrator, Stepper
from softbody_core.integrators.quasi_static import QuasiStatic
from softbody_core.integrators.rk4 import RK4
from softbody_core.integrators.sdirk2 import SDIRK2
from softbody_core.integrators.symplectic_euler import SymplecticEuler
from softbody_core.integrators.velocity_verlet import VelocityVerlet

INTEGRATORS: Final[dict[str, type[Integrator]]] = {
    "symplectic-euler": SymplecticEuler,
    "velocity-verlet": VelocityVerlet,
    "rk4": RK4,
    "backward-euler": BackwardEuler,
    "sdirk2": SDIRK2,
    "bdf2": BDF2,
    "quasi-static": QuasiStatic,
}

__all__ = [
    "BDF2",
    "INTEGRATORS",
    "RK4",
    "SDIRK2",
    "BackwardEuler",
    "Counters",
    "Integrator",
    "QuasiStatic",
    "Stepper",
    "SymplecticEuler",
    "VelocityVerlet",
]
