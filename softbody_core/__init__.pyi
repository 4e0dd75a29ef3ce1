# What `softbody_core` exports, and where it lives: imported when it is first asked for.

from .body import SavedBody, SoftBody
from .constraints import (
    CONSTRAINTS,
    Constraint,
    PinnedPoints,
    PinnedTop,
    Projection,
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
    BDF2,
    INTEGRATORS,
    RK4,
    SDIRK2,
    BackwardEuler,
    Counters,
    QuasiStatic,
    SymplecticEuler,
    VelocityVerlet,
)
from .mesh import SurfaceMesh
from .model import SoftBodyModel
from .observation import Observation
from .older_names import Restraint, Work, ball
from .rigid import RigidBody
from .shapes import fibonacci_sphere, icosphere, revolved, wine_glass
from .state import Inputs, RigidState, State
from .weights import Weights

__all__ = [
    "BDF2",
    "CONSTRAINTS",
    "FORCES",
    "INTEGRATORS",
    "RK4",
    "SDIRK2",
    "AirwayResistance",
    "BackwardEuler",
    "Bending",
    "Constraint",
    "Contact",
    "Counters",
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
    "Projection",
    "QuasiStatic",
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
    "fibonacci_sphere",
    "icosphere",
    "revolved",
    "wine_glass",
]
