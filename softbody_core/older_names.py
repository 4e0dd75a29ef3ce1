"""Names that things had before. They stay importable from `softbody_core`."""

from softbody_core.constraints import Projection
from softbody_core.integrators import Counters
from softbody_core.shapes import fibonacci_sphere

Restraint = Projection
Work = Counters
ball = fibonacci_sphere

__all__ = ["Restraint", "Work", "ball"]
