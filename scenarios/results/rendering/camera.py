"""Where a picture is taken from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """Where a picture is taken from.

    Attributes
    ----------
    azimuth, elevation : float
        Direction from the target to the camera: from the x axis about z, and above the horizon, °.
    target : tuple of float
        Middle of the picture, m.
    height : float
        Of what the picture shows, m.
    pixels : tuple of int
        Width and height of the picture.
    """

    azimuth: float
    elevation: float
    target: tuple[float, float, float]
    height: float
    pixels: tuple[int, int]

    @property
    def axes(self) -> Array:
        """Unit vectors to the right, up, and toward the camera, as rows."""
        return _axes(self.azimuth, self.elevation)

    @classmethod
    def around(
        cls, points: Array, azimuth: float, elevation: float, pixels_high: int, margin: float = 0.04
    ) -> Camera:
        """Return a camera whose picture holds all points, shape (n, 3), and no more."""
        axes = _axes(azimuth, elevation)
        projected = points.reshape(-1, 3) @ axes.T
        low, high = projected.min(axis=0), projected.max(axis=0)
        width, height = (high - low)[:2] + 2 * margin * (high - low)[1]
        x, y, z = ((low + high) / 2 @ axes).tolist()
        pixels = max(1, round(pixels_high * float(width / height))), pixels_high
        return cls(azimuth, elevation, (x, y, z), float(height), pixels)


def _axes(azimuth: float, elevation: float) -> Array:
    a, e = np.radians([azimuth, elevation])
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(toward, right), toward])
