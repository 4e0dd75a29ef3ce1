"""An FMU as a participant, in this process or in one of its own."""

from cosim.fmu.participant import FmuParticipant

__all__ = ["FmuParticipant"]
