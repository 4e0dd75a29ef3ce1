"""Cost of coupling: what a communication step takes beside the body's own step.

`SoftBody.step` is wrapped with a timer; what is left of a communication step is the loop, the
wiring, the FMU and the recording. Beside it stands the same FMU in a bare fmpy loop: set the
inputs, do a step, get the outputs. That loop is timed twice, alone and with the body stepping in
between, untimed: the same calls are slower after a body's step.

Run: python benchmarks/coupling.py
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import process_time

import numpy as np
from measure import calibrating_seconds, table

import scenarios
from cosim import Causality, FmuParticipant, Recorder, SoftBodyParticipant, cosimulate
from scenarios import Scenario
from scenarios.running.assemble import build_body, connect, controller_path
from scenarios.running.variables import variables_of

ROUNDS = 3
HEADER = ["scenario", "points", "body", "coupling", "its median", "share of run", "fmpy", "alone"]


def main() -> None:
    """Measure and print."""
    print(table(HEADER, [_row(name) for name in ("sphere-lung", "lung")]), end="\n\n")
    print("µs of one communication step, mean of the best of three runs; median: of its steps")
    print("fmpy: bare loop with the body stepping in between, its median; alone: without a body")
    print(f"CAL now: {1e6 * calibrating_seconds():.1f} µs")


def _row(name: str) -> list[str]:
    scenario = scenarios.load(name)
    runs = [_coupled(scenario) for _ in range(ROUNDS)]
    body, coupling = min(runs, key=lambda run: run[1].mean())
    stepped = build_body(scenario)
    between = [_bare(scenario, lambda: stepped.step(scenario.coupling.step)) for _ in range(ROUNDS)]
    alone = [_bare(scenario, lambda: None) for _ in range(ROUNDS)]
    return [
        name,
        f"{stepped.model.mesh.n_points:,}",
        f"{1e6 * body.mean():.0f}",
        f"{1e6 * coupling.mean():.1f}",
        f"{1e6 * np.median(coupling):.1f}",
        f"{100 * coupling.sum() / (body.sum() + coupling.sum()):.2f} %",
        f"{1e6 * min(np.median(times) for times in between):.1f}",
        f"{1e6 * min(np.median(times) for times in alone):.1f}",
    ]


@contextmanager
def _controller(scenario: Scenario) -> Iterator[FmuParticipant]:
    path = controller_path(scenario.controller, scenario.folder)
    fmu = FmuParticipant(path, "controller", scenario.controller.parameters)
    try:
        yield fmu
    finally:
        fmu.close()


def _coupled(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Seconds in each of the body's steps, and in the rest of each communication step."""
    body = build_body(scenario)
    step, inside, reached = body.step, [], []

    def timed(dt: float, **inputs: float) -> object:
        started = process_time()
        seen = step(dt, **inputs)
        inside.append(process_time() - started)
        return seen

    body.step = timed
    with _controller(scenario) as fmu:
        participant = SoftBodyParticipant(body)
        recorder = Recorder([fmu, participant], variables_of([participant], fmu))
        for point in cosimulate(
            [fmu, participant],
            connect(fmu, participant.ports),
            step=scenario.coupling.step,
            steps=scenario.steps,
            algorithm=scenario.coupling.algorithm,
        ):
            recorder.record(point)
            reached.append(process_time())
    return np.array(inside), np.diff(reached) - np.array(inside)


def _bare(scenario: Scenario, between: Callable[[], object]) -> np.ndarray:
    """Seconds of each round of the FMU's calls through fmpy alone."""
    with _controller(scenario) as fmu:
        fmu.initialize(0.0)
        fmu.begin()
        calls, variables = fmu._calls, fmu._variables
        slave, inputs, outputs = calls.fmu, [], {}
        for port in fmu.ports.values():
            variable = variables[port.name]
            if port.causality is Causality.INPUT:
                inputs.append(variable.valueReference)
            else:
                get = getattr(slave, f"get{calls.kind(variable)}")
                outputs.setdefault(get, []).append(variable.valueReference)
        values, h, times = [2.5] * len(inputs), scenario.coupling.step, []
        for index in range(scenario.steps):
            between()
            started = process_time()
            slave.setReal(inputs, values)
            slave.doStep(index * h, h)
            for get, references in outputs.items():
                get(references)
            times.append(process_time() - started)
    return np.array(times)


if __name__ == "__main__":
    main()
