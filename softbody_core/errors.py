"""What can go wrong with a body.

Every message names the thing, its value, what was expected and what to try.
"""

from __future__ import annotations

from softbody_core.ground.errors import SimulationError


class SoftBodyError(SimulationError):
    """Base of the errors of a body: of its surface and its motion."""


class MeshError(SoftBodyError, ValueError):
    """A surface is not a closed, consistently wound triangle mesh."""


class StepLimitError(SoftBodyError, RuntimeError):
    """A communication step would need more substeps than the integrator may take."""


class CrowdedError(SoftBodyError, ArithmeticError):
    """So many points are near each other that the surface must have fallen in on itself.

    Parameters
    ----------
    pairs, points : int
        Pairs found, and points of the surface.
    radius : float
        Distance within which points count as neighbours, m.
    """

    def __init__(self, pairs: int, points: int, radius: float) -> None:
        self.pairs = pairs
        self.points = points
        self.radius = radius
        super().__init__(pairs, points, radius)

    def __str__(self) -> str:
        """One sentence with the numbers and what to try."""
        return (
            f"{self.pairs} pairs among {self.points} points lie within {self.radius:.3g} m of each "
            "other, many times what a surface holds: it has fallen in on itself, or core_radius is "
            "too large. Try more pressure, stiffer springs, or a smaller core_radius."
        )


class SqueezedError(SoftBodyError, ArithmeticError):
    """Points have no place left between obstacles that close on each other.

    Parameters
    ----------
    time : float
        Simulated time, s.
    obstacles : list of str
        Their names.
    """

    def __init__(self, time: float, obstacles: list[str]) -> None:
        self.time = time
        self.obstacles = obstacles
        super().__init__(time, obstacles)

    def __str__(self) -> str:
        """One sentence with the time, the obstacles and what to try."""
        return (
            f"at t = {self.time:.6g} s, points of the body have no place left between obstacles "
            f"{', '.join(self.obstacles)}; keep them further apart, or make them slower"
        )


class DivergenceError(SoftBodyError, ArithmeticError):
    """The body left the range of physical states; it stands at its last good state.

    Parameters
    ----------
    time : float
        Simulated time at which the fault was seen, s.
    quantity : str
        What went wrong, such as ``"volume"``.
    value : float
        The value that it took, in SI units.
    advice : str
        What to try.
    """

    def __init__(self, time: float, quantity: str, value: float, advice: str) -> None:
        self.time = time
        self.quantity = quantity
        self.value = value
        self.advice = advice
        super().__init__(time, quantity, value, advice)

    def __str__(self) -> str:
        """One sentence with the time, the quantity and what to try."""
        return (
            f"the body diverged at t = {self.time:.6g} s: {self.quantity} became {self.value:.4g}. "
            f"Try {self.advice}."
        )
