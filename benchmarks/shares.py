"""What each part of a step costs, as a share of the step.

Functions are wrapped with a timer that gives each moment to the innermost of them, so that shares
add up to the whole. The first table is one explicit step of all forces at 1,986 points, the second
the mean communication step of two breaths of the scenario `lung`, with the run's start and its
dataset in the rest. The round with the least time in all counts.

Run: python benchmarks/shares.py
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cached_property
from time import process_time
from unittest.mock import patch

import scipy.sparse.linalg
from measure import calibrating_ball, calibrating_seconds, table

import scenarios
from cosim import FmuParticipant, Recorder, SoftBodyParticipant
from cosim.connection import Wiring
from softbody_core import (
    AirwayResistance,
    Gravity,
    InternalPressure,
    MassSpring,
    SoftBody,
    SoftBodyModel,
    SurfaceSPH,
    SymplecticEuler,
)
from softbody_core.configuration import Configuration
from softbody_core.forces.gravity import _BoundGravity
from softbody_core.forces.mass_spring import _BoundMassSpring
from softbody_core.forces.pair_geometry import PairGeometry
from softbody_core.forces.surface_sph import _BoundSPH
from softbody_core.forces.volume_law import BoundPressure, BoundResistance
from softbody_core.ground.anderson import Anderson
from softbody_core.integrators import symplectic_euler
from softbody_core.integrators.constant_operator import ConstantOperator
from softbody_core.integrators.quasi_newton import Linearization, QuasiNewton
from softbody_core.integrators.symplectic_euler import _SymplecticEuler
from softbody_core.neighbours import NeighbourList
from softbody_core.state import Inputs, State

ROUNDS = 3
STEPS = 200

GEOMETRY = {
    (Configuration, "_edge_ends"): "geometry: ends of edges",
    (Configuration, "edge_vectors"): "geometry: edges",
    (Configuration, "edge_lengths"): "geometry: edges",
    (Configuration, "volume_gradient"): "geometry: volume gradient",
    (Configuration, "volume"): "geometry: volume",
    (Configuration, "bounding_box"): "geometry: bounding box",
}
FORCES = {
    (_BoundMassSpring, "force"): "springs and dampers",
    (BoundPressure, "force"): "pressure",
    (_BoundGravity, "force"): "gravity",
    (BoundResistance, "force"): "airway",
    (NeighbourList, "pairs"): "fluid: neighbours",
    (NeighbourList, "_search"): "fluid: a search",
    (PairGeometry, "move_to"): "fluid: pair geometry",
    (_BoundSPH, "_densities"): "fluid: densities",
    (_BoundSPH, "_drag"): "fluid: viscosity",
    (_BoundSPH, "force"): "fluid: pressure",
    (SoftBodyModel, "force"): "sum of the forces",
    (symplectic_euler, "kick"): "velocities and airway",
}
COUPLED = {
    (SoftBody, "step"): "rest of the integrator",
    (SoftBody, "observe"): "looking at the body",
    (QuasiNewton, "solve"): "residuals",
    (QuasiNewton, "linearize"): "linearization",
    (Linearization, "solve"): "linear solves",
    (ConstantOperator, "solve"): "linear solves",
    (scipy.sparse.linalg, "splu"): "factorizations",
    (Anderson, "next"): "Anderson acceleration",
    (FmuParticipant, "step"): "controller (FMU)",
    (FmuParticipant, "write"): "controller (FMU)",
    (FmuParticipant, "read"): "controller (FMU)",
    (SoftBodyParticipant, "step"): "ports and wiring",
    (Wiring, "inputs_of"): "ports and wiring",
    (Recorder, "record"): "recording",
}


class Timer:
    """Seconds by part; each moment belongs to the part that was entered last."""

    def __init__(self) -> None:
        self.seconds: Counter[str] = Counter()
        self.calls: Counter[str] = Counter()
        self._inside = ["rest"]
        self._since = process_time()

    def _switch(self) -> None:
        now = process_time()
        self.seconds[self._inside[-1]] += now - self._since
        self._since = now

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Give what happens inside to a part."""
        self._switch()
        self.calls[name] += 1
        self._inside.append(name)
        try:
            yield
        finally:
            self._switch()
            self._inside.pop()

    def wrapped(self, owner: object, name: str, part: str) -> object:
        """Return what stands for a function, a method or a lazy property."""
        original = vars(owner)[name]
        lazy = isinstance(original, cached_property)
        function = original.func if lazy else original

        def timed(*arguments: object, **options: object) -> object:
            with self.part(part):
                return function(*arguments, **options)

        if not lazy:
            return timed
        replacement = cached_property(timed)
        replacement.__set_name__(owner, name)
        return replacement


Parts = dict[tuple[object, str], str]


@contextmanager
def timing(parts: Parts) -> Iterator[Timer]:
    """Time parts within the block."""
    timer = Timer()
    with ExitStack() as stack:
        for (owner, name), part in parts.items():
            stack.enter_context(patch.object(owner, name, timer.wrapped(owner, name, part)))
        yield timer


def main() -> None:
    """Measure and print."""
    _show("one explicit step", _explicit, GEOMETRY | FORCES, STEPS)
    scenario = scenarios.load("lung", {"run.cycles": 2})
    parts = GEOMETRY | FORCES | COUPLED
    prepared = lambda: lambda: scenarios.run(scenario)  # noqa: E731
    _show("one communication step of `lung`", prepared, parts, scenario.steps)


def _explicit() -> Callable[[], None]:
    mesh = calibrating_ball()
    laws = [MassSpring(375.0, 0.1), InternalPressure(2e-3), Gravity(), SurfaceSPH(30.0, 1.0)]
    model = SoftBodyModel(mesh, 1.0, [*laws, AirwayResistance(1e6)])
    inputs = Inputs(delta_p=100.0, n=1000.0)
    march = _SymplecticEuler(SymplecticEuler(), model)._march(State.at_rest(mesh), inputs, 1e-5)

    def steps() -> None:
        for _ in range(STEPS):
            _, _, here = next(march)
            _ = here.volume  # as the check of each substep does

    return steps


def _show(
    title: str, prepare: Callable[[], Callable[[], object]], parts: Parts, count: int
) -> None:
    rounds, bare, cal = [], [], []
    for _ in range(ROUNDS):  # in turn, so that a machine that slows down slows all
        rounds.append(_round(prepare, parts, count))
        bare.append(_round(prepare, {}, count)[0])
        cal.append(calibrating_seconds())
    whole, timer = min(rounds, key=lambda one: one[0])
    rows = [
        [
            part,
            f"{timer.calls[part] / count:.1f}" if part in timer.calls else "",
            f"{1e6 * seconds / count:.1f}",
            f"{seconds / count / min(cal):.2f}",
            f"{100 * seconds / sum(timer.seconds.values()):.1f} %",
        ]
        for part, seconds in timer.seconds.most_common()
    ]
    print(table([title, "calls", "µs", "×CAL", "share"], rows), end="\n\n")
    print(f"in all {1e6 * whole:.0f} µs; {1e6 * min(bare):.0f} µs without timers\n")


def _round(
    prepare: Callable[[], Callable[[], object]], parts: Parts, count: int
) -> tuple[float, Timer]:
    """Seconds of one step, and its timer."""
    steps = prepare()
    with timing(parts) as timer:
        steps()
        timer._switch()
    return sum(timer.seconds.values()) / count, timer


if __name__ == "__main__":
    main()
