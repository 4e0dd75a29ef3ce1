"""Cost of one explicit step, as a ratio to a calibrating workload in the same run.

The workload (CAL) is the graph Laplacian of the 1,986-point ball times a (1986, 3) array.

Run: python benchmarks/one_step.py
"""

from __future__ import annotations

import timeit
from collections.abc import Callable

import numpy as np

from softbody_core import (
    AirwayResistance,
    Gravity,
    InternalPressure,
    MassSpring,
    SoftBodyModel,
    SurfaceSPH,
    SymplecticEuler,
    ball,
)
from softbody_core.configuration import Configuration
from softbody_core.integrators.symplectic_euler import _SymplecticEuler
from softbody_core.state import Inputs, State

REPEATS = 7


def seconds(function: Callable[[], object], number: int) -> float:
    """Best time of one call."""
    function()
    return min(timeit.repeat(function, number=number, repeat=REPEATS)) / number


def main() -> None:
    """Measure and print."""
    mesh = ball(1986, 0.084)
    laplacian, points = mesh.laplacian, mesh.points.copy()
    base = [MassSpring(375.0, 0.1), InternalPressure(2e-3), Gravity()]
    cases = {
        "springs, damping, pressure, gravity": base,
        "the same with airway resistance": [*base, AirwayResistance(1e6)],
        "the same with airway resistance and SPH": [
            *base,
            AirwayResistance(1e6),
            SurfaceSPH(30.0, 1.0),
        ],
    }
    inputs = Inputs(delta_p=100.0, n=1000.0)
    for name, laws in cases.items():
        model = SoftBodyModel(mesh, 1.0, laws)
        march = _SymplecticEuler(SymplecticEuler(), model)._march(State.at_rest(mesh), inputs, 1e-5)
        step = seconds(lambda march=march: next(march), 200)
        calibrating = seconds(lambda: laplacian @ points, 400)
        print(f"{name:42} {1e6 * step:7.0f} µs  {step / calibrating:5.1f} CAL")
    here = Configuration(mesh, State.at_rest(mesh).positions)
    still = np.zeros_like(here.positions)
    for law in [*base, AirwayResistance(1e6), SurfaceSPH(30.0, 1.0)]:
        force = law.bind(mesh, mesh.point_areas)

        def fresh(force: object = force) -> object:
            return force.force(Configuration(mesh, here.positions), still, inputs)

        one = seconds(fresh, 200)
        calibrating = seconds(lambda: laplacian @ points, 400)
        print(f"  {type(law).__name__:40} {1e6 * one:7.0f} µs  {one / calibrating:5.1f} CAL")


if __name__ == "__main__":
    main()
