"""Springs beside a membrane: what a force evaluation costs, and how true an inflated sphere is.

The two laws have the same modulus at small strains, Y/(1 − ν) = √3 k_s. Shapes at rest are worked
out at a given volume, as the quasi-static integrator does; s is the cube root of that volume over
the volume at rest. The errors are those of the pressure that holds the sphere.

Run: python benchmarks/inflation.py
"""

from __future__ import annotations

import numpy as np
from measure import calibrating_ball, cost, table

from softbody_core import (
    Bending,
    Inputs,
    MassSpring,
    Membrane,
    SoftBodyModel,
    SurfaceMesh,
    fibonacci_sphere,
    icosphere,
)
from softbody_core.configuration import Configuration
from softbody_core.forces import Law
from softbody_core.integrators import Counters
from softbody_core.integrators.equilibrium_solver import EquilibriumSolver

VOLUME = 2.5e-3
SPRINGS = MassSpring(375.0)
MEMBRANE = Membrane(2 / np.sqrt(3) * SPRINGS.stiffness, poisson_ratio=1 / 3)
STRETCHES = (1.1, 1.2, 1.3)
POINTS = (162, 642, 2562)
POINTS_ON_THE_WAY = 8


def main() -> None:
    """Measure, work out and print."""
    laws = [SPRINGS, MassSpring(375.0, 0.1), MEMBRANE, Membrane(433.0, 1 / 3, 0.1), Bending(1e-3)]
    print(table(["law", "damping", "CAL"], [_cost(law) for law in laws]), end="\n\n")
    header = ["law", "surface", "points", *(f"s = {s}" for s in STRETCHES)]
    rows = []
    for law, exact in ((SPRINGS, of_springs), (MEMBRANE, of_membrane)):
        name, radius = type(law).__name__, float(np.cbrt(3 * VOLUME / (4 * np.pi)))
        closed = [exact(s, radius) for s in STRETCHES]
        rows.append([name, "closed form", "", *(f"{pressure:.1f} Pa" for pressure in closed)])
        for kind, make in (("icosphere", _icosphere), ("Fibonacci", fibonacci_sphere)):
            for n in POINTS:
                mesh = make(n).scaled_to_volume(VOLUME)
                found = [pressure(law, mesh, s) for s in STRETCHES]
                errors = [100 * (p / e - 1) for p, e in zip(found, closed, strict=True)]
                rows.append([name, kind, f"{n:,}", *(f"{error:+.3f} %" for error in errors)])
    print(table(header, rows))


def _cost(law: MassSpring | Membrane | Bending) -> list[str]:
    """One force evaluation at 1,986 points, with the geometry that it asks for."""
    mesh = calibrating_ball()
    force = law.bind(mesh, mesh.point_areas)
    positions = 1.1 * np.ascontiguousarray(mesh.points.T)
    velocities, here = 0.1 * positions, Configuration(mesh, positions)

    def evaluate() -> None:
        here.move_to(positions)
        force.force(here, velocities, Inputs())

    damped = "yes" if law.damping else "no"
    return [type(law).__name__, damped, f"{cost(evaluate, 100).cal:.1f}"]


def of_springs(stretch: float, radius: float) -> float:
    """Return p = 2√3 k_s/R₀ (1/s − 1/s²), Pa, of a net of equilateral triangles."""
    return 2 * np.sqrt(3) * SPRINGS.stiffness / radius * (1 / stretch - 1 / stretch**2)


def of_membrane(stretch: float, radius: float) -> float:
    """Return p = Y/((1 − ν) R₀) (s − 1/s), Pa.

    With E = (s² − 1)/2 in both directions U = 4πR₀² Y E²/(1 − ν), and p = dU/dV.
    """
    modulus = MEMBRANE.stiffness / (1 - MEMBRANE.poisson_ratio)
    return modulus / radius * (stretch - 1 / stretch)


def pressure(law: Law, mesh: SurfaceMesh, stretch: float) -> float:
    """Pressure that holds a surface at s³ times its volume, Pa."""
    model = SoftBodyModel(mesh, 1.0, [law])
    spacing = 3 * np.log(stretch) / POINTS_ON_THE_WAY
    solver = EquilibriumSolver(model, spacing, 1e-10, 300, Counters())
    point = solver.rest()
    for _ in range(POINTS_ON_THE_WAY):
        point = solver.next(point, 1)
    return point.balance.recoil


def _icosphere(points: int) -> SurfaceMesh:
    return icosphere(round(np.log((points - 2) / 10) / np.log(4)))


if __name__ == "__main__":
    main()
