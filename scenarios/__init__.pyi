# What `scenarios` exports, and where it lives: imported when it is first asked for.

from .errors import CheckpointError, OutputError, RunError, ScenarioError, SimulationError
from .results.analysis import Compartment, breaths, fit_compartment
from .results.plots import overview
from .running.checkpoint import Checkpoints
from .running.run import Progress, resume, run
from .scene.catalogue import load
from .scene.scenario import Scenario
from .scene.shipped import names
from .studies.trade.grid import GridProgress, trade
from .studies.trade.reference import reference, volume_error

__all__ = [
    "CheckpointError",
    "Checkpoints",
    "Compartment",
    "GridProgress",
    "OutputError",
    "Progress",
    "RunError",
    "Scenario",
    "ScenarioError",
    "SimulationError",
    "breaths",
    "fit_compartment",
    "load",
    "names",
    "overview",
    "reference",
    "resume",
    "run",
    "trade",
    "volume_error",
]
