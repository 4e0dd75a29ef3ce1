"""Cost of one explicit step, and of each force in it, as ratios to CAL.

Run: python benchmarks/one_step.py
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from measure import calibrating_ball, cost, table

from softbody_core import (
    AirwayResistance,
    Gravity,
    InternalPressure,
    MassSpring,
    SoftBodyModel,
    SurfaceSPH,
    SymplecticEuler,
)
from softbody_core.configuration import Configuration
from softbody_core.integrators.symplectic_euler import _SymplecticEuler
from softbody_core.state import Inputs, State


def main() -> None:
    """Measure and print."""
    mesh = calibrating_ball()
    base = [MassSpring(375.0, 0.1), InternalPressure(2e-3), Gravity()]
    resistance, fluid = AirwayResistance(1e6), SurfaceSPH(30.0, 1.0)
    cases = {
        "springs, damping, pressure, gravity": base,
        "with airway resistance": [*base, resistance],
        "with airway resistance and SPH": [*base, resistance, fluid],
    }
    inputs = Inputs(delta_p=100.0, n=1000.0)
    steps = []
    for name, laws in cases.items():
        model = SoftBodyModel(mesh, 1.0, laws)
        march = _SymplecticEuler(SymplecticEuler(), model)._march(State.at_rest(mesh), inputs, 1e-5)
        steps.append(_row(name, lambda march=march: next(march)))
    print(table(["one step at 1,986 points", "µs", "×CAL"], steps), end="\n\n")
    here = Configuration(mesh, State.at_rest(mesh).positions)
    still = np.zeros_like(here.positions)
    forces = []
    for law in [*base, resistance, fluid]:
        force = law.bind(mesh, mesh.point_areas)

        def fresh(force: object = force) -> object:
            return force.force(Configuration(mesh, here.positions), still, inputs)

        forces.append(_row(type(law).__name__, fresh))
    print(table(["one force, with the geometry it needs", "µs", "×CAL"], forces))


def _row(name: str, function: Callable[[], object]) -> list[str]:
    measured = cost(function, 200)
    return [name, f"{1e6 * measured.seconds:.0f}", f"{measured.cal:.1f}"]


if __name__ == "__main__":
    main()
