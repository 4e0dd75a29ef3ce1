"""The laws of force, one a file, and the table of them.

A new law is one file here and one line in `FORCES`.
"""

from __future__ import annotations

from typing import Final

from softbody_core.forces.airway_resistance import AirwayResistance
from softbody_core.forces.bending import Bending
from softbody_core.forces.gravity import Gravity
from softbody_core.forces.internal_pressure import InternalPressure
from softbody_core.forces.law import BoundLaw, Law, Majorants, Rates
from softbody_core.forces.mass_spring import MassSpring
from softbody_core.forces.membrane import Membrane
from softbody_core.forces.surface_sph import SurfaceSPH
from softbody_core.forces.volume_law import PressureLaw, ResistanceLaw

FORCES: Final[dict[str, type[Law]]] = {
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
    "BoundLaw",
    "Gravity",
    "InternalPressure",
    "Law",
    "Majorants",
    "MassSpring",
    "Membrane",
    "PressureLaw",
    "Rates",
    "ResistanceLaw",
    "SurfaceSPH",
]
