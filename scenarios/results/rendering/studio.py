"""What a picture is lit by."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from scenarios.results.rendering.camera import Camera


@dataclass(frozen=True)
class Light:
    """What a picture is lit by.

    Attributes
    ----------
    sky, lamp : float
        Radiance from all around, and what a lamp adds to it.
    radius : float
        Of the lamp in the sky, °.
    """

    sky: float
    lamp: float
    radius: float


NARROW: Final = Light(0.32, 5.0, 28.0)
"""Brings out a shape."""
WIDE: Final = Light(0.3, 1.1, 65.0)
"""The same through glass, where a path finds a small lamp too seldom: less grain."""
FLAT: Final = Light(0.8, 1.5, 28.0)
"""Leaves colours as they are."""


def studio(mi: Any, camera: Camera, light: Light) -> dict[str, Any]:
    """Light from all around and above, a lamp to the upper left, and a weak one to the right."""
    rows = 64
    polar = (np.arange(rows)[:, None] + 0.5) / rows * np.pi
    # A sky of Mitsuba's has y up. Turned about x, its columns run clockwise from the y axis.
    around = np.pi / 2 - (np.arange(2 * rows)[None] + 0.5) / rows * np.pi
    upright = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    sky = light.sky + 0.22 * np.cos(polar) + 0 * around

    def lamp(azimuth: float, elevation: float, radius: float, strength: float) -> None:
        a, e = np.radians([azimuth, elevation])
        cosine = np.cos(e) * np.sin(polar) * np.cos(around - a) + np.sin(e) * np.cos(polar)
        sky[np.arccos(np.clip(cosine, -1, 1)) < np.radians(radius)] += strength

    lamp(-50, 45, light.radius, light.lamp)
    lamp(75, 10, 25, 0.14 * light.lamp)
    pixels = np.repeat(sky[..., None], 3, axis=2).astype(np.float32)
    turned = mi.ScalarTransform4f().rotate([0, 0, 1], camera.azimuth)
    return {"type": "envmap", "bitmap": mi.Bitmap(pixels), "to_world": turned @ upright}


def backdrop(mi: Any, camera: Camera) -> dict[str, Any]:
    """Return a white wall that shines, behind: glass shows dark edges on it."""
    behind = np.array(camera.target) - 4 * camera.height * camera.axes[2]
    half = 0.75 * camera.height * max(1.0, camera.pixels[0] / camera.pixels[1])
    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f()
        .look_at(origin=behind.tolist(), target=list(camera.target), up=[0, 0, 1])
        .scale([half, half, 1]),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 1.0}},
    }
