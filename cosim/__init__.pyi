# What `cosim` exports, and where it lives: imported when it is first asked for.

from .algorithms import ALGORITHMS, Adaptive, EventLocating, GaussSeidel, Iterated, Jacobi
from .connection import Connection
from .errors import (
    ControllerError,
    CouplingError,
    FmuCrashError,
    FmuEndedError,
    FmuError,
    FmuStepError,
    FmuTimeoutError,
    SignalError,
    SimulationError,
    WiringError,
)
from .fmu import FmuParticipant
from .loop import CommunicationPoint, CoSimulation, cosimulate
from .older_names import Change, Variable
from .participant import Causality, Participant, Port, Variability
from .recorder import RecordedVariable, Recorder
from .soft_body import SoftBodyParticipant
from .units import Unit, UnitError, quantity, unit

__all__ = [
    "ALGORITHMS",
    "Adaptive",
    "Causality",
    "Change",
    "CoSimulation",
    "CommunicationPoint",
    "Connection",
    "ControllerError",
    "CouplingError",
    "EventLocating",
    "FmuCrashError",
    "FmuEndedError",
    "FmuError",
    "FmuParticipant",
    "FmuStepError",
    "FmuTimeoutError",
    "GaussSeidel",
    "Iterated",
    "Jacobi",
    "Participant",
    "Port",
    "RecordedVariable",
    "Recorder",
    "SignalError",
    "SimulationError",
    "SoftBodyParticipant",
    "Unit",
    "UnitError",
    "Variability",
    "Variable",
    "WiringError",
    "cosimulate",
    "quantity",
    "unit",
]
