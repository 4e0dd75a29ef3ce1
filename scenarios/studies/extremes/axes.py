"""What is taken to its extremes: the table of axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from scenarios.studies.extremes.cases import Case
from scenarios.studies.extremes.shapes import SHAPES
from softbody_core import AirwayResistance, MassSpring, SurfaceSPH


@dataclass(frozen=True)
class ExtremeAxis:
    """One thing that is taken to its extremes, alone.

    Attributes
    ----------
    unit : str
        Of the values.
    values : tuple
        Values of the full map, in order.
    few : tuple
        Values of the reduced map.
    change : callable
        From the scenario's case and a value to the case at that value.
    """

    unit: str
    values: tuple[float | str, ...]
    few: tuple[float | str, ...]
    change: Callable[[Case, Any], Case]


_ALL: Final = (0.0, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9)
_FEW: Final = (0.0, 1e9)
_PRESSURES: Final = (-1e5, -1e4, -1e3, -1e2, 0.0, 1e2, 1e3, 1e4, 1e5)
_STEPS: Final = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0)
_SIZES: Final = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0, 1e2, 1e3)
_MASSES: Final = (1e-30, 1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e9, 1e30)
_FEW_SHAPES: Final = (
    "as it is",
    "sliver, 1e-6",
    "two points at one",
    "flat",
    "inside out",
    "1e9 m away",
    "starts with two points at one",
    "starts flat",
    "starts inside out",
    "starts as a clump, 1e-6",
    "starts as one point",
)


def _with_fluid(case: Case) -> Case:
    return case.with_law(SurfaceSPH)


AXES: Final[dict[str, ExtremeAxis]] = {
    "alpha": ExtremeAxis("1", _ALL, _FEW, lambda case, v: case.weighted(alpha=v)),
    "stiffness": ExtremeAxis(
        "N/m", _ALL, _FEW, lambda case, v: case.with_law(MassSpring, stiffness=v)
    ),
    "damping": ExtremeAxis(
        "N.s/m", _ALL, _FEW, lambda case, v: case.with_law(MassSpring, damping=v)
    ),
    "beta": ExtremeAxis("1", _ALL, _FEW, lambda case, v: _with_fluid(case).weighted(beta=v)),
    "gas_constant": ExtremeAxis(
        "m^2/s^2", _ALL, _FEW, lambda case, v: case.with_law(SurfaceSPH, gas_constant=v)
    ),
    "viscosity": ExtremeAxis(
        "Pa.s", _ALL, _FEW, lambda case, v: case.with_law(SurfaceSPH, viscosity=v)
    ),
    "gamma": ExtremeAxis("1", _ALL, _FEW, lambda case, v: case.weighted(gamma=v)),
    "n": ExtremeAxis("1", _ALL, _FEW, lambda case, v: case.with_inputs(n=v)),
    "delta_p": ExtremeAxis(
        "Pa", _PRESSURES, (-1e5, 1e5), lambda case, v: case.with_inputs(delta_p=v)
    ),
    "resistance": ExtremeAxis(
        "Pa.s/m^3",
        (*_ALL, 1e12),
        (0.0, 1e12),
        lambda case, v: case.with_law(AirwayResistance, resistance=v),
    ),
    "mass": ExtremeAxis("kg", _MASSES, (1e-30, 1e30), lambda case, v: replace(case, mass=v)),
    "dt": ExtremeAxis("s", _STEPS, (1e-7, 10.0), lambda case, v: replace(case, dt=v)),
    "scale": ExtremeAxis("m", _SIZES, (1e-6, 1e3), lambda case, v: case.with_radius(v)),
    "points": ExtremeAxis(
        "1",
        (4, 5, 12, 100, 1000, 10_000, 50_000),
        (4, 100),
        lambda case, v: case.with_points(v),
    ),
    "shape": ExtremeAxis("", tuple(SHAPES), _FEW_SHAPES, lambda case, v: case.shaped(v)),
}
"""Axes by name. A new one is one entry here."""
