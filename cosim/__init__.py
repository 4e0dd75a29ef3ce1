"""Two or more participants in step, over typed ports. No physics."""

from cosim.algorithms import ALGORITHMS, GaussSeidel, Jacobi
from cosim.connection import Connection
from cosim.errors import (
    ControllerError,
    FmuCrashError,
    FmuEndedError,
    FmuError,
    FmuStepError,
    FmuTimeoutError,
    SignalError,
    WiringError,
)
from cosim.fmu import FmuParticipant
from cosim.loop import CommunicationPoint, cosimulate
from cosim.participant import Causality, Participant, Port
from cosim.recorder import Recorder, Variable
from cosim.soft_body import SoftBodyParticipant
from cosim.units import Unit, UnitError, quantity, unit

__all__ = [
    "ALGORITHMS",
    "Causality",
    "CommunicationPoint",
    "Connection",
    "ControllerError",
    "FmuCrashError",
    "FmuEndedError",
    "FmuError",
    "FmuParticipant",
    "FmuStepError",
    "FmuTimeoutError",
    "GaussSeidel",
    "Jacobi",
    "Participant",
    "Port",
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
