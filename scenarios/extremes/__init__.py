"""What becomes of a body at the extremes: a map, and what each place on it is worth."""

from scenarios.extremes.plot import picture
from scenarios.extremes.survey import survey
from scenarios.extremes.verdict import Outcome

__all__ = ["Outcome", "picture", "survey"]
