"""What is taken to its extremes: the table of axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from scenarios.studies.extremes.cases import Case
from scenarios.studies.extremes.shapes import SHAPES
from softbody_core import AirwayResistance, MassSpring, SurfaceSPH


@dataclass(frozen=True)
class Axis:
    """One thing that is taken to its extremes, alone.

    Attributes
    ----------
    unit, meaning : str
        Unit and name of the values.
    values : tuple
        Values of the full map, in order.
    few : tuple
        Values of the reduced map.
    change : callable
        From the scenario's case and a value to the case at that value.
    """

    unit: str
    meaning: str
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


AXES: Final[dict[str, Axis]] = {
    "alpha": Axis(
        "1", "weight of body structure", _ALL, _FEW, lambda case, v: case.weighted(alpha=v)
    ),
    "stiffness": Axis(
        "N/m",
        "spring stiffness",
        _ALL,
        _FEW,
        lambda case, v: case.with_law(MassSpring, stiffness=v),
    ),
    "damping": Axis(
        "N.s/m", "spring damping", _ALL, _FEW, lambda case, v: case.with_law(MassSpring, damping=v)
    ),
    "beta": Axis(
        "1",
        "weight of anamorphosis",
        _ALL,
        _FEW,
        lambda case, v: _with_fluid(case).weighted(beta=v),
    ),
    "gas_constant": Axis(
        "m^2/s^2",
        "gas constant of the fluid",
        _ALL,
        _FEW,
        lambda case, v: case.with_law(SurfaceSPH, gas_constant=v),
    ),
    "viscosity": Axis(
        "Pa.s",
        "viscosity of the fluid",
        _ALL,
        _FEW,
        lambda case, v: case.with_law(SurfaceSPH, viscosity=v),
    ),
    "gamma": Axis(
        "1", "weight of volume control", _ALL, _FEW, lambda case, v: case.weighted(gamma=v)
    ),
    "n": Axis("1", "molecules inside", _ALL, _FEW, lambda case, v: case.with_inputs(n=v)),
    "delta_p": Axis(
        "Pa",
        "pressure difference",
        _PRESSURES,
        (-1e5, 1e5),
        lambda case, v: case.with_inputs(delta_p=v),
    ),
    "resistance": Axis(
        "Pa.s/m^3",
        "airway resistance",
        (*_ALL, 1e12),
        (0.0, 1e12),
        lambda case, v: case.with_law(AirwayResistance, resistance=v),
    ),
    "mass": Axis("kg", "mass", _MASSES, (1e-30, 1e30), lambda case, v: replace(case, mass=v)),
    "dt": Axis(
        "s", "communication step", _STEPS, (1e-7, 10.0), lambda case, v: replace(case, dt=v)
    ),
    "scale": Axis("m", "rest radius", _SIZES, (1e-6, 1e3), lambda case, v: case.with_radius(v)),
    "points": Axis(
        "1",
        "number of points",
        (4, 5, 12, 100, 1000, 10_000, 50_000),
        (4, 100),
        lambda case, v: case.with_points(v),
    ),
    "shape": Axis("", "shape", tuple(SHAPES), _FEW_SHAPES, lambda case, v: case.shaped(v)),
}
"""Axes by name. A new one is one entry here."""
