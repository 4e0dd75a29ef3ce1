"""Volume and area of refined surfaces converge at second order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ellipeinc, ellipkinc

from softbody_core import SurfaceMesh, fibonacci_sphere


def ellipsoid_area(a: float, b: float, c: float) -> float:
    """Legendre's closed form, a ≥ b ≥ c."""
    phi = np.arccos(c / a)
    k2 = a**2 * (b**2 - c**2) / (b**2 * (a**2 - c**2))
    mixed = ellipeinc(phi, k2) * np.sin(phi) ** 2 + ellipkinc(phi, k2) * np.cos(phi) ** 2
    return 2 * np.pi * c**2 + 2 * np.pi * a * b / np.sin(phi) * mixed


SHAPES = {
    "sphere": ((1.0, 1.0, 1.0), 4 * np.pi),
    "ellipsoid": ((2.0, 1.3, 0.7), ellipsoid_area(2.0, 1.3, 0.7)),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_volume_and_area_converge_at_second_order(shape):
    axes, area = SHAPES[shape]
    volume = 4 / 3 * np.pi * np.prod(axes)
    sizes, volume_errors, area_errors = [], [], []
    for n in (250, 500, 1000, 2000, 4000):
        sphere = fibonacci_sphere(n)
        mesh = SurfaceMesh.from_arrays(sphere.points * axes, sphere.triangles)
        sizes.append(n**-0.5)
        volume_errors.append(abs(mesh.volume / volume - 1))
        area_errors.append(abs(mesh.area / area - 1))
    for errors in (volume_errors, area_errors):
        order = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
        # Fibonacci points are not nested, so the errors scatter a little about their law
        assert order == pytest.approx(2, abs=0.05)
        assert errors[-1] < 2e-3
