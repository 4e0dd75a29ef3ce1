"""A soft body after Mesit & Guha (2011), and how it moves."""

from softbody_core.body import Observation, SavedBody, SoftBody
from softbody_core.constraints import CONSTRAINTS, PinnedPoints, PinnedTop
from softbody_core.errors import (
    CrowdedError,
    DivergenceError,
    MeshError,
    ParameterError,
    SoftBodyError,
    StepLimitError,
)
from softbody_core.forces import (
    FORCES,
    AirwayResistance,
    Gravity,
    InternalPressure,
    MassSpring,
    SurfaceSPH,
)
from softbody_core.integrators import (
    INTEGRATORS,
    RK4,
    SDIRK2,
    SymplecticEuler,
    VelocityVerlet,
    Work,
)
from softbody_core.mesh import SurfaceMesh
from softbody_core.model import SoftBodyModel
from softbody_core.shapes import ball, icosphere
from softbody_core.state import Inputs, State
from softbody_core.weights import Weights

__all__ = [
    "CONSTRAINTS",
    "FORCES",
    "INTEGRATORS",
    "RK4",
    "SDIRK2",
    "AirwayResistance",
    "CrowdedError",
    "DivergenceError",
    "Gravity",
    "Inputs",
    "InternalPressure",
    "MassSpring",
    "MeshError",
    "Observation",
    "ParameterError",
    "PinnedPoints",
    "PinnedTop",
    "SavedBody",
    "SoftBody",
    "SoftBodyError",
    "SoftBodyModel",
    "State",
    "StepLimitError",
    "SurfaceMesh",
    "SurfaceSPH",
    "SymplecticEuler",
    "VelocityVerlet",
    "Weights",
    "Work",
    "ball",
    "icosphere",
]
