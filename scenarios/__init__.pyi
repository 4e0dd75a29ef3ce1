# What `scenarios` exports, and where it lives: imported when it is first asked for.

from .errors import (
    CheckpointError,
    Interrupted,
    OutputError,
    RunError,
    ScenarioError,
    SimulationError,
)
from .older_names import GridProgress, reference
from .results.analysis import Compartment, breaths, fit_compartment
from .results.comparison import volume_error
from .results.plots import overview
from .running.checkpoint import Checkpoints
from .running.progress import Progress
from .running.run import resume, run
from .scene.catalogue import load
from .scene.scenario import Scenario
from .scene.shipped import names
from .studies.trade.grid import trade
from .studies.trade.reference import converged_reference

__all__ = [
    "CheckpointError",
    "Checkpoints",
    "Compartment",
    "GridProgress",
    "Interrupted",
    "OutputError",
    "Progress",
    "RunError",
    "Scenario",
    "ScenarioError",
    "SimulationError",
    "breaths",
    "converged_reference",
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
