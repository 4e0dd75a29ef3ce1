"""Constraints C of S3D, one idea a file, and the table of them.

A new constraint is one file here and one line in `CONSTRAINTS`.
"""

from __future__ import annotations

from typing import Final

from softbody_core.constraints.constraint import Constraint, Projection
from softbody_core.constraints.pinned import PinnedPoints, PinnedTop
from softbody_core.constraints.volume_cap import VolumeCap
from softbody_core.constraints.weight_relations import WeightCourse, WeightRatio

CONSTRAINTS: Final[dict[str, type[Constraint]]] = {
    "pinned_points": PinnedPoints,
    "pinned_top": PinnedTop,
    "volume_cap": VolumeCap,
    "weight_ratio": WeightRatio,
    "weight_course": WeightCourse,
}

__all__ = [
    "CONSTRAINTS",
    "Constraint",
    "PinnedPoints",
    "PinnedTop",
    "Projection",
    "VolumeCap",
    "WeightCourse",
    "WeightRatio",
]
