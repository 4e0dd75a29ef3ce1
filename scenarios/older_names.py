"""Names that things had before. They stay importable from `scenarios`."""

from scenarios.running.progress import StudyProgress
from scenarios.studies.trade.reference import converged_reference

GridProgress = StudyProgress
reference = converged_reference

__all__ = ["GridProgress", "reference"]
