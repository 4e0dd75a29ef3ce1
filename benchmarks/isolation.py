"""Cost of isolation: a communication step of one FMU in this process and in one of its own.

The shipped pressure-control steps with one output read; nothing else is computed. The two take
turns, so that both see the same machine.

Run: python benchmarks/isolation.py
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

import numpy as np
from measure import calibrating_seconds, table

from cosim import FmuParticipant
from cosim.controllers import controller_fmu
from cosim.fmu.isolation import ISOLATIONS

ROUNDS, STEPS, FRAME = 10, 500, 1 / 30


def main() -> None:
    """Measure and print."""
    starts, steps = {}, {name: [] for name in ISOLATIONS}
    with _running("none", starts) as here, _running("process", starts) as alone:
        for index in range(ROUNDS):
            for name, fmu in (("none", here), ("process", alone)):
                steps[name].append(_median(fmu, index * STEPS))
    rows = [[name, f"{1e6 * min(steps[name]):.1f}", f"{starts[name]:.2f}"] for name in ISOLATIONS]
    print(table(["isolation", "step (µs)", "start (s)"], rows), end="\n\n")
    print(f"steps: least of {ROUNDS} medians of {STEPS} steps")
    print(f"CAL now: {1e6 * calibrating_seconds():.1f} µs")


@contextmanager
def _running(isolation: str, starts: dict[str, float]) -> Iterator[FmuParticipant]:
    began = perf_counter()
    fmu = ISOLATIONS[isolation](controller_fmu("pressure-control"))
    try:
        fmu.initialize(0.0)
        fmu.begin()
        starts[isolation] = perf_counter() - began
        yield fmu
    finally:
        fmu.close()


def _median(fmu: FmuParticipant, first: int) -> float:
    times = []
    for index in range(first, first + STEPS):
        began = perf_counter()
        fmu.step(index * FRAME, FRAME)
        fmu.read()
        times.append(perf_counter() - began)
    return float(np.median(times))


if __name__ == "__main__":
    main()
