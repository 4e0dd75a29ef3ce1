"""What an obstacle costs in a step: none, one far away, one below, and one that is rested on.

The ball of the glass scenes, 1,986 points without fluid, in turns, so that all share the machine's
moods. Times are for a frame of 0.25 ms with one inner step; the best round counts.

Run: python benchmarks/obstacle.py
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

import scenarios
from scenarios.running.assemble import build_body
from softbody_core import SoftBody

FRAME, GAS = 2.5e-4, 13_500.0
ROUNDS, FRAMES = 30, 20
LANDED = 2000


def bodies() -> dict[str, SoftBody]:
    """One body a row of the table, where it should be."""
    floating = {"forces.delta": 0}
    scene = scenarios.load("glass-a", floating)
    far = scenarios.load("glass-a", {**floating, "mesh.position": ["0 m", "0 m", "0.5 m"]})
    resting = build_body(scenarios.load("glass-a"))
    for _ in range(LANDED):
        resting.step(FRAME, n=GAS)
    return {
        "no obstacle": build_body(replace(scene, obstacles=())),
        "0.3 m above the glass": build_body(far),
        "1 cm above the glass": build_body(scene),
        "resting in the glass": resting,
    }


def main() -> None:
    """Print a table."""
    best: dict[str, float] = {}
    all_of_them = bodies()
    for _ in range(ROUNDS):
        for name, body in all_of_them.items():
            started = perf_counter()
            for _ in range(FRAMES):
                body.step(FRAME, n=GAS)
            spent = (perf_counter() - started) / FRAMES
            best[name] = min(best.get(name, spent), spent)
    least = best["no obstacle"]
    for name, spent in best.items():
        print(f"{name:24} {1e6 * spent:6.0f} µs   × {spent / least:.2f}")


if __name__ == "__main__":
    main()
