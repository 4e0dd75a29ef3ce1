"""The base of every error, and the one error that all floors raise.

Every message names the thing, its value, what was expected and what to try.
"""

from __future__ import annotations


class SimulationError(Exception):
    """Base of every error that this project raises on purpose."""


class ParameterError(SimulationError, ValueError):
    """A parameter has a value that the model does not allow."""
