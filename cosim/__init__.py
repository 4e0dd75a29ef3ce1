"""Two or more participants in step, over typed ports. No physics."""

from cosim.algorithms import ALGORITHMS, Adaptive, EventLocating, GaussSeidel, Iterated, Jacobi
from cosim.connection import Connection
from cosim.errors import (
    ControllerError,
    CouplingError,
    FmuCrashError,
    FmuEndedError,
    FmuError,
    FmuStepError,
    FmuTimeoutError,
    SignalError,
    WiringError,
)
from cosim.fmu import FmuParticipant
from cosim.loop import CommunicationPoint, CoSimulation, cosimulate
from cosim.participant import Causality, Change, Participant, Port
from cosim.recorder import RecordedVariable, Recorder
from cosim.recorder import RecordedVariable as Variable
from cosim.soft_body import SoftBodyParticipant
from cosim.units import Unit, UnitError, quantity, unit

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
    "SoftBodyParticipant",
    "Unit",
    "UnitError",
    "Variable",
    "WiringError",
    "cosimulate",
    "quantity",
    "unit",
]
