"""The force laws, one a file, and the table of them.

A new law is one file here and one line in `FORCES`.
"""

from __future__ import annotations

from typing import Final

from softbody_core.forces.airway_resistance import AirwayResistance
from softbody_core.forces.bending import Bending
from softbody_core.forces.force import BoundForce, Force, RankOne, Rates, Tangent
from softbody_core.forces.gravity import Gravity
from softbody_core.forces.internal_pressure import InternalPressure
from softbody_core.forces.mass_spring import MassSpring
from softbody_core.forces.membrane import Membrane
from softbody_core.forces.surface_sph import SurfaceSPH

FORCES: Final[dict[str, type[Force]]] = {
    "mass_spring": MassSpring,
    "membrane": Membrane,
    "bending": Bending,
    "surface_sph": SurfaceSPH,
    "internal_pressure": InternalPressure,
    "gravity": Gravity,
    "airway_resistance": AirwayResistance,
}

__all__ = [
    "FORCES",
    "AirwayResistance",
    "Bending",
    "BoundForce",
    "Force",
    "Gravity",
    "InternalPressure",
    "MassSpring",
    "Membrane",
    "RankOne",
    "Rates",
    "SurfaceSPH",
    "Tangent",
]
