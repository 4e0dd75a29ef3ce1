"""What becomes of a body at the extremes: a map, and what each place on it is worth."""

from scenarios.studies.extremes.plot import picture
from scenarios.studies.extremes.survey import survey
from scenarios.studies.extremes.verdict import Outcome

__all__ = ["Outcome", "picture", "survey"]
