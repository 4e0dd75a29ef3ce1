"""How large a step may be, and when a body has left the range of physical states."""

from __future__ import annotations

import math

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.errors import DivergenceError
from softbody_core.forces import Rates
from softbody_core.ground.errors import ParameterError
from softbody_core.model import SoftBodyModel
from softbody_core.state import State

LARGEST_VOLUME_RATIO = 1000.0
"""Enclosed volume over rest volume that counts as a runaway."""

CALMER = "a smaller step, smaller inputs, a larger alpha, or more damping"
_FIRMER = "a larger delta_p or n, a larger gamma, or stiffer springs: the body has collapsed"


def largest_stable_step(rates: Rates) -> float:
    """Stability limit of symplectic Euler, s.

    A mode of frequency ω and damping rate c is stable while h²ω² + 2hc ≤ 4 (for c = 0 this is the
    2/ω of leapfrog). Infinite where nothing pulls back.

    Parameters
    ----------
    rates : Rates
        Bounds of ω² and of c over all modes.
    """
    stiffness, damping = rates
    if stiffness == 0 and damping == 0:
        return math.inf
    # The positive root, written so that nothing cancels when either term is small.
    return 4 / (damping + math.sqrt(damping**2 + 4 * stiffness))


def check_state(state: State, model: SoftBodyModel) -> None:
    """Refuse a state that is not one of a model's body.

    Raises
    ------
    ParameterError
        If there are not as many points or obstacles.
    DivergenceError
        If a number is not finite, or the volume not one of a body.
    """
    expected = model.mesh.n_points
    for name, values in (("positions", state.positions), ("velocities", state.velocities)):
        if values.shape != (3, expected):
            raise ParameterError(
                f"state.{name} have shape {values.shape}; expected (3, {expected})"
            )
    if len(state.obstacles) != len(model.obstacles):
        raise ParameterError(
            f"the state has {len(state.obstacles)} obstacles, the body {len(model.obstacles)}; "
            "change the body's own state, as with dataclasses.replace(body.state, positions=…)"
        )
    check_finite(state)
    check_volume(state.time, Configuration(model.mesh, state.positions))


def check_finite(state: State) -> None:
    """Raise `DivergenceError` for NaN or Inf."""
    for quantity, values in (("a position", state.positions), ("a velocity", state.velocities)):
        if not np.isfinite(values).all():
            raise DivergenceError(state.time, quantity, math.nan, CALMER)


def check_volume(time: float, configuration: Configuration) -> None:
    """Raise `DivergenceError` for a collapsed or a runaway volume."""
    ratio = configuration.volume / configuration.mesh.volume
    if not 0 < ratio <= LARGEST_VOLUME_RATIO:
        raise diverged_volume(time, ratio)


def diverged_volume(time: float, ratio: float) -> DivergenceError:
    """Error for a volume that is no longer physical, as a ratio to that at rest."""
    # A wall that meets itself has a volume near 0; far beyond on either side, it flew apart.
    advice = _FIRMER if -1 <= ratio <= 1 else CALMER
    return DivergenceError(time, "volume over rest volume", ratio, advice)
