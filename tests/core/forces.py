"""One example of each force law, and helpers that look at a force from outside."""

from __future__ import annotations

from typing import Final

import numpy as np

from softbody_core import (
    AirwayResistance,
    Bending,
    Gravity,
    InternalPressure,
    MassSpring,
    Membrane,
    SurfaceSPH,
)
from softbody_core.configuration import Configuration
from softbody_core.state import Inputs

INPUTS: Final = Inputs(delta_p=350.0, n=40_000.0)

EXAMPLES: Final = {
    "mass_spring": [MassSpring(120.0, 0.3)],
    "membrane": [Membrane(140.0, 1 / 3, 0.3), Membrane(140.0, -0.4)],
    "bending": [Bending(0.1, 0.01)],
    "surface_sph": [
        SurfaceSPH(30.0, 0.8, 2.2),
        SurfaceSPH(300.0, 0.0, 1.5),
        SurfaceSPH(30.0, 0.5, 2.0, pressure="difference"),
    ],
    "internal_pressure": [
        InternalPressure(1e-3),
        InternalPressure(1e-3, "enclosed-volume"),
        InternalPressure(1e-3, "enclosed-volume", "whole"),
    ],
    "gravity": [Gravity()],
    "airway_resistance": [AirwayResistance(2e5)],
}
"""Laws with the parameters that they are tested with, by their names in `FORCES`."""

ALL: Final = [law for laws in EXAMPLES.values() for law in laws]


def bound(law, mesh, mass=0.5):
    """Law on a mesh, and the masses."""
    masses = mass * mesh.point_areas / mesh.area
    return law.bind(mesh, masses), masses


def deformed(mesh, generator, amount=0.15):
    """Random positions near rest, stretched and turned, (3, n)."""
    size = mesh.edge_lengths.mean()
    stretch = np.eye(3) + 0.3 * generator.uniform(-1, 1, size=(3, 3))
    noise = amount * size * generator.normal(size=mesh.points.shape)
    return np.ascontiguousarray((mesh.points @ stretch.T + noise).T)


def force_at(force, mesh, positions, velocities=None, inputs=INPUTS):
    """Force at positions and velocities."""
    still = np.zeros_like(positions)
    configuration = Configuration(mesh, positions)
    return force.force(configuration, still if velocities is None else velocities, inputs)


def jacobian(function, at, step):
    """Fourth-order central differences of a (3, n) → (3, n) function, as a matrix."""
    columns = []
    for index in range(at.size):
        move = np.zeros(at.size)
        move[index] = step
        move = move.reshape(at.shape)
        near = function(at + move) - function(at - move)
        far = function(at + 2 * move) - function(at - 2 * move)
        columns.append(((8 * near - far) / (12 * step)).ravel())
    return np.array(columns).T
