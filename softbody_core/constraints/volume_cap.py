"""A largest volume, as of a lung in its chest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.constraints.constraint import Constraint, Projection
from softbody_core.errors import DivergenceError
from softbody_core.ground.arrays import Floats
from softbody_core.ground.errors import ParameterError
from softbody_core.ground.parameters import Parameters, Quantity
from softbody_core.mesh import SurfaceMesh
from softbody_core.state import State

_MOST_ITERATIONS: Final = 20

_CALMER: Final = "a smaller max_step of the volume cap: the body is far beyond it in one step"

_NEAR: Final = 0.5
"""Part of the bound beyond which it counts as near: a jump of pressure leaves little time."""


@dataclass(frozen=True)
class VolumeCap(Parameters, Constraint):
    """The enclosed volume does not exceed a bound: V ≤ V_max.

    The reaction is a pressure on the outside of the whole wall, of whatever size it takes: what it
    takes out of positions and velocities is along M⁻¹ ∂V/∂x, and nothing else.

    Parameters
    ----------
    volume : float
        V_max, m³.
    max_step : float
        Longest inner step while the bound is near, s.
    """

    volume: Annotated[float, Quantity("m^3", above=0)]
    max_step: Annotated[float, Quantity("s", above=0)] = 5e-3

    def bind(self, mesh: SurfaceMesh, masses: Floats, inverse_masses: Floats) -> Projection:
        """Put the bound on one body.

        Raises
        ------
        ParameterError
            If the body at rest exceeds it.
        """
        if mesh.volume > self.volume:
            raise ParameterError(
                f"VolumeCap.volume = {self.volume:.6g} m^3: the body at rest already encloses "
                f"{mesh.volume:.6g} m^3; expected at least that"
            )
        return _CapProjection(self, mesh, inverse_masses)


class _CapProjection(Projection):
    def __init__(self, cap: VolumeCap, mesh: SurfaceMesh, inverse_masses: Floats) -> None:
        self._cap = cap
        self._mesh = mesh
        self._inverse_masses = inverse_masses

    def longest_step(self, state: State, dt: float) -> float:
        configuration = Configuration(self._mesh, state.positions)
        flow = float(np.vdot(configuration.volume_gradient, state.velocities))
        near = configuration.volume + 2 * abs(flow) * dt > _NEAR * self._cap.volume
        return min(dt, self._cap.max_step) if near else dt

    def project(self, before: State, after: State) -> State:
        configuration = Configuration(self._mesh, after.positions)
        if configuration.volume <= self._cap.volume:
            return after
        positions = after.positions
        for _ in range(_MOST_ITERATIONS):  # Newton's method; V is a cubic of the positions
            excess = configuration.volume - self._cap.volume
            if excess <= 1e-14 * self._cap.volume:
                break
            positions = positions - self._growth(configuration, excess)
            configuration = Configuration(self._mesh, positions)
        else:
            ratio = configuration.volume / self._mesh.volume
            raise DivergenceError(after.time, "volume over rest volume", ratio, _CALMER)
        flow = max(0.0, float(np.vdot(configuration.volume_gradient, after.velocities)))
        velocities = after.velocities - self._growth(configuration, flow)
        return replace(after, positions=positions, velocities=velocities)

    def _growth(self, configuration: Configuration, amount: float) -> Floats:
        """Move along M⁻¹ ∂V/∂x that adds an amount to V, m³, or velocities that add to dV/dt."""
        direction = self._inverse_masses * configuration.volume_gradient
        mobility = float(np.vdot(configuration.volume_gradient, direction))
        return (amount / mobility) * direction
