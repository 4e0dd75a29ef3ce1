"""Names that things had before. They stay importable from `cosim`."""

from cosim.participant import Variability
from cosim.recorder import RecordedVariable

Change = Variability
Variable = RecordedVariable

__all__ = ["Change", "Variable"]
