"""Examples of each constraint, on a ball of 100 points and 5 cm."""

from __future__ import annotations

from typing import Final

from softbody_core import (
    PinnedPoints,
    PinnedTop,
    VolumeCap,
    WeightCourse,
    WeightRatio,
    fibonacci_sphere,
)

MESH: Final = fibonacci_sphere(100, 0.05)

EXAMPLES: Final = {
    "pinned_points": [PinnedPoints((3, 7, 20))],
    "pinned_top": [PinnedTop(0.05)],
    "volume_cap": [VolumeCap(1.02 * MESH.volume)],
    "weight_ratio": [WeightRatio("beta", "alpha", 0.3)],
    "weight_course": [WeightCourse("alpha", (0.0, 0.05), (1.0, 3.0))],
}
"""Constraints that a body under 500 Pa meets within 40 ms, by their names in `CONSTRAINTS`."""

ALL: Final = [constraint for examples in EXAMPLES.values() for constraint in examples]
