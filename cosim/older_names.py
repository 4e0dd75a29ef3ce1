"""Names that things had before. They stay importable from `cosim`."""

from cosim.recorder import RecordedVariable

Variable = RecordedVariable

__all__ = ["Variable"]
