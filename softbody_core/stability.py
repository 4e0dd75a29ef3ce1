"""How large a step may be, and when a body has left the range of physical states."""

from __future__ import annotations

import math

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.errors import DivergenceError
from softbody_core.forces import Rates
from softbody_core.state import State

LARGEST_VOLUME_RATIO = 1000.0
"""Enclosed volume over rest volume that counts as a runaway."""


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


def check_physical(state: State, configuration: Configuration) -> None:
    """Raise `DivergenceError` for NaN, Inf, a collapsed or a runaway volume."""
    if not np.isfinite(state.positions).all():
        raise DivergenceError(
            state.time,
            "a position",
            math.nan,
            "a smaller step, softer springs, more damping, or a smaller input",
        )
    if not np.isfinite(state.velocities).all():
        raise DivergenceError(
            state.time,
            "a velocity",
            math.nan,
            "a smaller step, softer springs, more damping, or a smaller input",
        )
    rest, volume = configuration.mesh.volume, configuration.volume
    if volume > LARGEST_VOLUME_RATIO * rest:
        raise DivergenceError(
            state.time,
            "volume over rest volume",
            volume / rest,
            "a smaller delta_p or n, a larger alpha, or stiffer springs",
        )
    if configuration.bounding_box_volume <= 0 or volume <= 0:
        raise DivergenceError(
            state.time,
            "volume over rest volume",
            volume / rest,
            "a larger delta_p or n, a larger gamma, or stiffer springs: the body has collapsed",
        )
