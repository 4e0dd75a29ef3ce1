"""What is true of the ball of the peers' benchmark, from its laws and not from any simulator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from measure import calibrating_ball
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, minimize

from softbody_core.configuration import Configuration

Floats = NDArray[np.float64]

MASS: Final = 1.0
STIFFNESS: Final = 375.0
DAMPING: Final = 0.1
PRESSURE: Final = 500.0
"""Highest pressure of the breath, Pa."""

BREATH: Final = 4.0
RING: Final = 0.25
"""How long the ball breathes freely, s: five periods."""


def pressure_at(time: float) -> float:
    """Pressure of one breath, Pa: rises and falls smoothly."""
    return PRESSURE * (1 - np.cos(2 * np.pi * time / BREATH)) / 2


def volume_of(points: Floats) -> float:
    """Enclosed volume of the ball's triangles, m³, for points of shape (n, 3)."""
    return Configuration(calibrating_ball(), np.ascontiguousarray(points.T)).volume


def volume_gradient_of(points: Floats) -> Floats:
    """∂V/∂x, m², shape (n, 3): pressure times this is the force on each point."""
    return Configuration(calibrating_ball(), np.ascontiguousarray(points.T)).volume_gradient.T


def spring_forces(points: Floats) -> Floats:
    """Forces of the spring net, N, shape (n, 3)."""
    mesh = calibrating_ball()
    along = mesh.edge_difference @ points
    tension = STIFFNESS * (1 - mesh.edge_lengths / np.linalg.norm(along, axis=1))
    return -(mesh.edge_difference.T @ (tension[:, None] * along))


def spring_balance() -> Callable[[float], float]:
    """Volume of the spring net at which it balances a pressure, by least energy."""
    mesh = calibrating_ball()

    def energy(flat: Floats, pressure: float) -> tuple[float, Floats]:
        points = flat.reshape(-1, 3)
        lengths = np.linalg.norm(mesh.edge_difference @ points, axis=1)
        stored = STIFFNESS / 2 * float(np.sum((lengths - mesh.edge_lengths) ** 2))
        slope = -spring_forces(points) - pressure * volume_gradient_of(points)
        return stored - pressure * volume_of(points), slope.ravel()

    pressures = np.linspace(0, PRESSURE, 9)
    shape = mesh.points.ravel()
    volumes = []
    for pressure in pressures:
        options = {"maxiter": 5000, "maxfun": 10_000, "ftol": 1e-15, "gtol": 1e-8}
        shape = minimize(energy, shape, (pressure,), "L-BFGS-B", jac=True, options=options).x
        volumes.append(volume_of(shape.reshape(-1, 3)))
    return CubicSpline(pressures, volumes)


SHELL_POISSON: Final = 1 / 3
SHELL_YOUNG: Final = 2 / np.sqrt(3) * STIFFNESS
"""Young's modulus times thickness, N/m, of the shell that is as stiff as an even spring net."""


def shell_balance() -> Callable[[float], float]:
    """Volume at which a shell after Saint Venant and Kirchhoff balances a pressure.

    With the stretch s, W = A Y (s² − 1)²/4 for Y = E t/(1 − ν), and p = dW/dV.
    """
    mesh = calibrating_ball()
    modulus = SHELL_YOUNG / (1 - SHELL_POISSON)

    def volume(pressure: float) -> float:
        def excess(s: float) -> float:
            return modulus * mesh.area * (s**2 - 1) / (3 * mesh.volume * s) - pressure

        return mesh.volume * brentq(excess, 0.5, 2.0) ** 3

    return volume


def kick() -> Floats:
    """Velocities that start the breathing, m/s, (n, 3): a short pull by 5 % of stretch."""
    points = calibrating_ball().points
    return 2e-4 * spring_forces(1.05 * points) / (MASS / len(points))


def free_period(*, along_edges: bool) -> float:
    """Period of the freely breathing spring net, s, by a scheme of eighth order.

    Dampers resist the relative velocity of an edge's ends, or only its part along the edge. On a
    net as uneven as this one it matters which, since small waves then ring or do not.
    """
    mesh = calibrating_ball()
    n = mesh.n_points
    directions = (mesh.edge_difference @ mesh.points) / mesh.edge_lengths[:, None]

    def motion(_: float, state: Floats) -> Floats:
        x, v = state.reshape(2, n, 3)
        relative = mesh.edge_difference @ v
        if along_edges:
            relative = np.sum(relative * directions, axis=1, keepdims=True) * directions
        force = spring_forces(x) - DAMPING * (mesh.edge_difference.T @ relative)
        return np.concatenate([v, force / (MASS / n)]).ravel()

    start = np.concatenate([mesh.points, kick()]).ravel()
    times = np.linspace(0, RING, 501)
    path = solve_ivp(motion, (0, RING), start, "DOP853", times, rtol=1e-6, atol=1e-9).y
    return period(times, np.array([volume_of(y[: 3 * n].reshape(n, 3)) for y in path.T]))


def period(times: Floats, volumes: Floats) -> float:
    """Mean period of a volume, s, from where it rises through its mean."""
    about = volumes - volumes.mean()
    rises = np.flatnonzero((about[:-1] < 0) & (about[1:] >= 0))
    if len(rises) < 2:
        return np.nan
    share = about[rises] / (about[rises] - about[rises + 1])
    crossings = times[rises] + share * (times[rises + 1] - times[rises])
    return float((crossings[-1] - crossings[0]) / (len(crossings) - 1))
