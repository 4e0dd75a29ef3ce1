"""Participants packed for other masters: as an FMU, and wired with a controller as an SSP."""

from cosim.export.configured import build_configured
from cosim.export.interface import INTERFACE, Interface, Variable, ports_as_variables
from cosim.export.platforms import PLATFORM, platforms_of
from cosim.export.ssp import Component, bound_parameters, write_ssp
from cosim.export.standards import standard

__all__ = [
    "INTERFACE",
    "PLATFORM",
    "Component",
    "Interface",
    "Variable",
    "bound_parameters",
    "build_configured",
    "platforms_of",
    "ports_as_variables",
    "standard",
    "write_ssp",
]
