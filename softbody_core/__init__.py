"""A soft body after Mesit & Guha (2011), and how it moves."""

from softbody_core.body import SavedBody, SoftBody
from softbody_core.constraints import (
    CONSTRAINTS,
    Constraint,
    PinnedPoints,
    PinnedTop,
    Projection,
    VolumeCap,
    WeightCourse,
    WeightRatio,
)
from softbody_core.contact import Contact
from softbody_core.errors import (
    CrowdedError,
    DivergenceError,
    MeshError,
    SoftBodyError,
    SqueezedError,
    StepLimitError,
)
from softbody_core.forces import (
    FORCES,
    AirwayResistance,
    Bending,
    Gravity,
    InternalPressure,
    MassSpring,
    Membrane,
    SurfaceSPH,
)
from softbody_core.ground.errors import ParameterError, SimulationError
from softbody_core.integrators import (
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
from softbody_core.mesh import SurfaceMesh
from softbody_core.model import SoftBodyModel
from softbody_core.observation import Observation
from softbody_core.rigid import RigidBody
from softbody_core.shapes import fibonacci_sphere, icosphere, revolved, wine_glass
from softbody_core.state import Inputs, RigidState, State
from softbody_core.weights import Weights

ball = fibonacci_sphere  # older names
Restraint = Projection
Work = Counters

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
