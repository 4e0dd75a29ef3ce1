# What `softbody_core` exports, and where it lives: imported when it is first asked for.

from .body import SavedBody, SoftBody
from .constraints import (
    CONSTRAINTS,
    Constraint,
    PinnedPoints,
    PinnedTop,
    Restraint,
    VolumeCap,
    WeightCourse,
    WeightRatio,
)
from .contact import Contact
from .errors import (
    CrowdedError,
    DivergenceError,
    MeshError,
    SoftBodyError,
    SqueezedError,
    StepLimitError,
)
from .forces import (
    FORCES,
    AirwayResistance,
    Bending,
    Gravity,
    InternalPressure,
    MassSpring,
    Membrane,
    SurfaceSPH,
)
from .ground.errors import ParameterError, SimulationError
from .integrators import (
    INTEGRATORS,
    RK4,
    SDIRK2,
    SymplecticEuler,
    VelocityVerlet,
    Work,
)
from .mesh import SurfaceMesh
from .model import SoftBodyModel
from .observation import Observation
from .rigid import RigidBody
from .shapes import ball, icosphere, revolved, wine_glass
from .state import Inputs, RigidState, State
from .weights import Weights

__all__ = [
    "CONSTRAINTS",
    "FORCES",
    "INTEGRATORS",
    "RK4",
    "SDIRK2",
    "AirwayResistance",
    "Bending",
    "Constraint",
    "Contact",
    "CrowdedError",
    "DivergenceError",
    "Gravity",
    "Inputs",
    "InternalPressure",
    "MassSpring",
    "Membrane",
    "MeshError",
    "Observation",
    "ParameterError",
    "PinnedPoints",
    "PinnedTop",
    "Restraint",
    "RigidBody",
    "RigidState",
    "SavedBody",
    "SimulationError",
    "SoftBody",
    "SoftBodyError",
    "SoftBodyModel",
    "SqueezedError",
    "State",
    "StepLimitError",
    "SurfaceMesh",
    "SurfaceSPH",
    "SymplecticEuler",
    "VelocityVerlet",
    "VolumeCap",
    "WeightCourse",
    "WeightRatio",
    "Weights",
    "Work",
    "ball",
    "icosphere",
    "revolved",
    "wine_glass",
]
