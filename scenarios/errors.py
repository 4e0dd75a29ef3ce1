"""What can go wrong with a scenario or its run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from softbody_core.ground.errors import SimulationError as SimulationError

if TYPE_CHECKING:  # a command that prints its help has no use for xarray
    import xarray as xr


class ScenarioError(SimulationError, ValueError):
    """A scenario is not as expected; the message starts with the path of the bad field."""


class OutputError(SimulationError, OSError):
    """A result cannot be written where it should go."""


class CheckpointError(SimulationError, ValueError):
    """A checkpoint cannot be read, or does not fit what is there now."""


class RunError(SimulationError, RuntimeError):
    """A run ended early; what was computed until then is in `dataset`.

    Attributes
    ----------
    dataset : xarray.Dataset
        Everything up to the last good communication point, with the reason in ``status``.
    """

    def __init__(self, message: str, dataset: xr.Dataset) -> None:
        super().__init__(message)
        self.dataset = dataset


class Interrupted(RunError):
    """A run was interrupted, by Ctrl-C; what was computed until then is in `dataset`."""
