"""Meshes and numbers that many tests share."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softbody_core import SurfaceMesh, fibonacci_sphere


@pytest.fixture(scope="session")
def tetrahedron() -> SurfaceMesh:
    """Regular, edge length 1 m."""
    points = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(8)
    return SurfaceMesh.from_arrays(points, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])


@pytest.fixture(scope="session")
def potato() -> SurfaceMesh:
    """Irregular on purpose: no symmetry that could hide a mistake. About 0.1 m."""
    sphere = fibonacci_sphere(42)
    generator = np.random.default_rng(20111211)
    stretched = sphere.points * [0.10, 0.07, 0.13] + 0.005 * generator.normal(size=(42, 3))
    return SurfaceMesh.from_arrays(stretched + np.array([0.3, -0.2, 0.1]), sphere.triangles)


@pytest.fixture(scope="session")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Compile a foreign FMU, see `tests.cosim.foreign.compiled`; each is compiled once."""
    from tests.cosim.foreign import COMPILER, compiled

    if COMPILER is None:
        pytest.skip("no C compiler to make FMUs with")

    @cache
    def built(version: int, *defines: str, **options: Any) -> Path:
        return compiled(tmp_path_factory.mktemp("foreign"), version, *defines, **options)

    return built
