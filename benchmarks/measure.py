"""What the benchmarks share: a best-of timer, and the workload that times are ratios of.

The workload (CAL) is the graph Laplacian of the 1,986-point ball, in CSR, times a (1986, 3) array.
A ratio to CAL in the same run says more than a time: it repeats on another day and machine. All
times are of this process alone (`process_time`), so that others on the machine count less.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from time import process_time
from typing import NamedTuple

from softbody_core import SurfaceMesh, fibonacci_sphere

ROUNDS = 7


class Cost(NamedTuple):
    """Best time of one call, s, and its ratio to the best time of CAL in the same rounds."""

    seconds: float
    cal: float


def cost(function: Callable[[], object], number: int = 1, rounds: int = ROUNDS) -> Cost:
    """Time `number` calls and CAL in turn, so that a machine that slows down slows both."""
    function()
    best, best_cal = float("inf"), float("inf")
    for _ in range(rounds):
        best = min(best, seconds(function, number))
        best_cal = min(best_cal, calibrating_seconds())
    return Cost(best, best / best_cal)


def calibrating_seconds() -> float:
    """Mean time of CAL, now."""
    mesh = calibrating_ball()
    laplacian, points = mesh.laplacian, mesh.points.copy()
    return seconds(lambda: laplacian @ points, 400)


def seconds(function: Callable[[], object], number: int = 1) -> float:
    """Mean time of one call among `number`."""
    started = process_time()
    for _ in range(number):
        function()
    return (process_time() - started) / number


@cache
def calibrating_ball() -> SurfaceMesh:
    """Ball of 1,986 points with a radius of 84 mm: both lungs as one sphere."""
    return fibonacci_sphere(1986, 0.084)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown table with columns in line: the first to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        first, *others = zip(cells, widths, strict=True)
        padded = [first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in others)]
        return f"| {' | '.join(padded)} |"

    rule = ["-" * widths[0], *("-" * (width - 1) + ":" for width in widths[1:])]
    return "\n".join([line(header), line(rule), *map(line, rows)])
