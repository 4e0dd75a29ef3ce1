"""What to run, and what comes of it.

>>> import scenarios
>>> lung = scenarios.load("sphere-lung", {"run.cycles": 1})
>>> float(scenarios.run(lung)["volume"].max()) > 5
True
"""

from scenarios.errors import CheckpointError, Interrupted, OutputError, RunError, ScenarioError
from scenarios.results.analysis import Compartment, breaths, fit_compartment
from scenarios.results.comparison import volume_error
from scenarios.results.plots import overview
from scenarios.running.checkpoint import Checkpoints
from scenarios.running.progress import Progress
from scenarios.running.progress import StudyProgress as GridProgress
from scenarios.running.run import resume, run
from scenarios.scene.catalogue import load, names
from scenarios.scene.scenario import Scenario
from scenarios.studies.trade.grid import trade
from scenarios.studies.trade.reference import converged_reference
from scenarios.studies.trade.reference import converged_reference as reference

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
