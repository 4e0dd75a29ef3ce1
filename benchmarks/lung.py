"""Speed of the scenario `lung` at a given accuracy, with the fluid and without.

Errors are of the first breath, against SDIRK2 at a tolerance of 1e-5; speeds are of five breaths.

Run: python benchmarks/lung.py
"""

from __future__ import annotations

from typing import Any

from measure import table

import scenarios

WAYS: list[dict[str, Any]] = [
    {"method": "quasi-static"},
    {"method": "quasi-static", "spacing": 0.025},
    {"method": "sdirk2", "tolerance": 1e-1},
    {"method": "sdirk2", "tolerance": 1e-2},
    {"method": "sdirk2", "tolerance": 3e-3},
    {"method": "sdirk2", "tolerance": 1e-3},
]


def main() -> None:
    """Measure and print."""
    rows = []
    for name, changes in (("with SPH", {}), ("without", {"forces.beta": 0.0})):
        lung = scenarios.load("lung", changes)
        breath = lung.changed({"run.cycles": 1})
        tight = scenarios.run(
            breath.changed({"integrator": {"method": "sdirk2", "tolerance": 1e-5}})
        )
        for way in WAYS:
            error = scenarios.volume_error(
                scenarios.run(breath.changed({"integrator": way})), tight
            )
            run = scenarios.run(lung.changed({"integrator": way}))
            options = ", ".join(f"{key} {value:g}" for key, value in way.items() if key != "method")
            rows.append(
                [
                    name,
                    f"{way['method']} {options}".strip(),
                    f"{error:.1e}",
                    f"{float(run['time'][-1]) / run.attrs['wall_time']:.1f}",
                    f"{run.attrs['force_evaluations']}",
                    f"{run.attrs['linear_solves']}",
                ]
            )
    print(table(["lung", "integrator", "error", "RTF", "forces", "solves"], rows))


if __name__ == "__main__":
    main()
