"""Cost per point of an explicit step from 2,000 to 200,000 points, and the memory it takes.

Linear means: the same cost per point, and the same memory, at any size. The ratio shows how far the
cost is from that. Memory is the peak that tracemalloc sees, which is all of NumPy's and SciPy's
arrays, in a pass of its own without timing.

Run: python benchmarks/scaling.py
"""

from __future__ import annotations

import gc
import tracemalloc
from collections.abc import Sequence
from time import process_time

from measure import cost, table

from softbody_core import (
    Gravity,
    InternalPressure,
    MassSpring,
    SoftBodyModel,
    SurfaceMesh,
    SurfaceSPH,
    SymplecticEuler,
    fibonacci_sphere,
)
from softbody_core.forces import Law
from softbody_core.integrators.symplectic_euler import _SymplecticEuler
from softbody_core.state import Inputs, State

SIZES = (2_000, 10_000, 50_000, 200_000)
BASE = [MassSpring(375.0, 0.1), InternalPressure(2e-3), Gravity()]
CASES = {
    "springs, damping, pressure, gravity": BASE,
    "the same with SPH": [*BASE, SurfaceSPH(30.0, 1.0)],
}
HEADER = ["points", "set-up, s", "step, ms", "×CAL", "ns/point", "ratio", "B/point", "held", "step"]


def main() -> None:
    """Measure and print."""
    for name, laws in CASES.items():
        rows: list[list[str]] = []
        smallest = 0.0
        for points in SIZES:
            started = process_time()
            march = _march(fibonacci_sphere(points, 0.084), laws)
            next(march)
            set_up = process_time() - started
            step = cost(lambda march=march: next(march), number=max(1, 400_000 // points))
            del march
            per_point = step.seconds / points
            smallest = smallest or per_point
            peak, held, step_peak = (memory / points for memory in _memory(points, laws))
            rows.append(
                [
                    f"{points:,}",
                    f"{set_up:.2f}",
                    f"{1e3 * step.seconds:.2f}",
                    f"{step.cal:.1f}",
                    f"{1e9 * per_point:.0f}",
                    f"{per_point / smallest:.2f}",
                    f"{peak:.0f}",
                    f"{held:.0f}",
                    f"{step_peak:.0f}",
                ]
            )
        print(f"{name}\n")
        print(table(HEADER, rows), end="\n\n")
    print("set-up: mesh, its checks and operators, forces, and the first step")
    print("ratio: of the cost per point to that at the first size")
    print("B/point: peak bytes a point of set-up; held: between steps; step: peak of a step")


def _march(mesh: SurfaceMesh, laws: Sequence[Law]):
    """Endless steps of a body that is pressed on but hardly moves."""
    model = SoftBodyModel(mesh, 1.0, laws)
    stepper = _SymplecticEuler(SymplecticEuler(), model)
    return stepper._march(State.at_rest(mesh), Inputs(delta_p=100.0, n=1000.0), 1e-6)


def _memory(points: int, laws: Sequence[Law]) -> tuple[int, int, int]:
    """Bytes: peak of the set-up, held between steps, peak of a step."""
    gc.collect()
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        march = _march(fibonacci_sphere(points, 0.084), laws)
        next(march)
        held, peak = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        next(march)
        _, step_peak = tracemalloc.get_traced_memory()
        return peak - before, held - before, step_peak - before
    finally:
        tracemalloc.stop()


if __name__ == "__main__":
    main()
