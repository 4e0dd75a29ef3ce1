"""The same ball of 1,986 points in this project, in MuJoCo and in pybullet, in one run.

Two tasks, each with a truth that no simulator makes (peer_truth.py):

- one breath: the pressure inside rises to 500 Pa and falls again within 4 s, set every 1/30 s as a
  controller does; the error is that of the volume over the rest volume, the truth is the
  equilibrium of the law at each pressure;
- breathing freely: a short pull, then the ball rings; the error is that of the period.

Each takes the longest of a few steps at which its error stays below 1e-2. Only its own stepping is
timed: MuJoCo gets the pressure as forces on points, whose computation outside is not counted.

Run: pip install -e ".[peers]" && python benchmarks/peers.py
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import NamedTuple

import numpy as np
from measure import calibrating_ball, calibrating_seconds, table
from peer_balls import Ball, MuJoCo, Ours, PyBullet
from peer_truth import (
    BREATH,
    RING,
    free_period,
    period,
    pressure_at,
    shell_balance,
    spring_balance,
)

from softbody_core import SDIRK2, SymplecticEuler
from softbody_core.integrators import QuasiStatic

ALLOWED = 1e-2
FRAMES = 120
FRAME = BREATH / FRAMES
SAMPLE = 1e-3
EXPLICIT_BREATH = (FRAME / 50, FRAME / 66, FRAME / 100)
EXPLICIT_RING = (SAMPLE, SAMPLE / 2, SAMPLE / 4)
HEADER = ["who: model; scheme", "step, ms", "ms/step", "×CAL", "RTF", "error", "ours is faster by"]

Make = Callable[[float], Ball]


class Result(NamedTuple):
    """What one ball needed for a task, and how wrong it was."""

    step: float
    seconds_per_step: float
    cal: float
    speed: float
    error: float


def main() -> None:
    """Measure and print."""
    here = {name: _version(name) for name in ("mujoco", "pybullet")}
    for name, number in here.items():
        print(f"{name}: {number or 'not installed; pip install -e .[peers]'}")
    print(f"\nOne breath of {BREATH:g} s, pressure set every {1e3 * FRAME:.0f} ms\n")
    springs, shell = spring_balance(), shell_balance()
    rows = {
        "this project: springs, pressure; SDIRK2": _best(
            lambda step: Ours(SDIRK2(max_step=step)), [FRAME], lambda ball: _breath(ball, springs)
        ),
        "this project: springs, pressure; quasi-static": _best(
            lambda _: Ours(QuasiStatic()), [FRAME], lambda ball: _breath(ball, springs)
        ),
        "this project: springs, pressure; symplectic Euler": _best(
            lambda step: Ours(SymplecticEuler(max_substep=step)),
            [FRAME],
            lambda ball: _breath(ball, springs),
        ),
    }
    if here["mujoco"]:
        rows["MuJoCo: shell, forces from outside; discrete"] = _best(
            lambda step: MuJoCo(step, triangles=True),
            [FRAME, FRAME / 2, FRAME / 4],
            lambda ball: _breath(ball, shell),
        )
        rows["MuJoCo: springs, forces from outside; Euler"] = _best(
            lambda step: MuJoCo(step, triangles=False),
            EXPLICIT_BREATH,
            lambda ball: _breath(ball, springs),
        )
    _show(rows)
    if here["pybullet"]:
        moved = "moves it" if PyBullet(SAMPLE).forces_reach_it() else "moves nothing"
        print("\npybullet: not possible. A deformable has no pressure in its Python interface, and")
        print(f"a force on one of its points (applyExternalForce) {moved}.")
    print(f"\nBreathing freely for {RING:g} s\n")
    everywhere, along = free_period(along_edges=False), free_period(along_edges=True)
    rows = {
        "this project: springs; symplectic Euler": _best(
            lambda step: Ours(SymplecticEuler(max_substep=step)),
            [SAMPLE],
            lambda ball: _ring(ball, everywhere, 5 * SAMPLE),
        ),
        "this project: springs; SDIRK2": _best(
            lambda step: Ours(SDIRK2(max_step=step)),
            [5e-3, 2.5e-3, 1.25e-3],
            lambda ball: _ring(ball, everywhere, 5 * SAMPLE),
        ),
    }
    if here["mujoco"]:
        rows["MuJoCo: springs; Euler"] = _best(
            lambda step: MuJoCo(step, triangles=False),
            EXPLICIT_RING,
            lambda ball: _ring(ball, along),
        )
    if here["pybullet"]:
        rows["pybullet: springs; its own"] = _best(
            PyBullet, EXPLICIT_RING, lambda ball: _ring(ball, along)
        )
    _show(rows)
    print("\npybullet is held against the period along the springs, which fits it better.")
    print("RTF: simulated seconds in a second of computing; faster by: the best RTF of this")
    print("project over that of the row. Dampers act along the springs in the peers, and in all")
    print(f"directions here: true periods {1e3 * along:.2f} and {1e3 * everywhere:.2f} ms.")


def _version(name: str) -> str | None:
    try:
        __import__(name)
        return version(name)
    except (ImportError, PackageNotFoundError):
        return None


def _best(make: Make, steps: Sequence[float], task: Callable[[Ball], Result]) -> Result:
    """Result at the longest step whose error is allowed, or else at the last."""
    for step in steps:
        result = task(make(step))
        if result.error < ALLOWED:
            break
    return result


def _breath(ball: Ball, balance: Callable[[float], float]) -> Result:
    def error() -> float:
        errors = []
        for index in range(1, FRAMES + 1):
            pressure = pressure_at(index * FRAME)
            errors.append(abs(ball.advance(FRAME, pressure) - balance(pressure)))
        return max(errors) / calibrating_ball().volume

    return _result(ball, BREATH, error)


def _ring(ball: Ball, true_period: float, sample: float = SAMPLE) -> Result:
    def error() -> float:
        ball.kick()
        times = sample * np.arange(1, round(RING / sample) + 1)
        volumes = np.array([ball.advance(sample, 0.0) for _ in times])
        return abs(period(times, volumes) / true_period - 1)

    return _result(ball, RING, error)


def _result(ball: Ball, span: float, run: Callable[[], float]) -> Result:
    cal = calibrating_seconds()
    try:
        error = run()
    except ArithmeticError:  # it blew up, and said so
        error = np.inf
    cal = min(cal, calibrating_seconds())
    each = ball.seconds / ball.steps
    reached = span if np.isfinite(error) else np.nan
    return Result(span / ball.steps, each, each / cal, reached / ball.seconds, error)


def _show(results: Mapping[str, Result]) -> None:
    own = max(result.speed for who, result in results.items() if who.startswith("this project"))
    rows = [
        [
            who,
            f"{1e3 * result.step:.2f}",
            f"{1e3 * result.seconds_per_step:.2f}",
            f"{result.cal:.0f}",
            f"{result.speed:.2f}",
            f"{result.error:.1e}" if np.isfinite(result.error) else "blew up",
            f"{own / result.speed:.1f}",
        ]
        for who, result in results.items()
    ]
    print(table(HEADER, rows))


if __name__ == "__main__":
    main()
