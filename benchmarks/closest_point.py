"""What the closest point of a mesh costs: libigl beside trimesh, on the wine glass.

Points lie within a millimetre of the glass, as those of a ball that touches it, or anywhere in a
box of twice its size. Both answers are compared with the nearest of all triangles, one by one.
trimesh's query needs rtree, which is not installed with this project.

Truth comes from trimesh's closest point on one triangle, which itself errs by 3 µm on slivers at
192 segments: sampling that triangle densely agrees with libigl.

Run: python benchmarks/closest_point.py
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from time import process_time

import numpy as np
import trimesh
from measure import table
from numpy.typing import NDArray

from softbody_core import SurfaceMesh, wine_glass
from softbody_core.contact.closest_point import ClosestPoint

ROUNDS = 5
POINTS = 2000
FEWER = 200
"""Points for trimesh, and for all triangles one by one, which are slower."""

Floats = NDArray[np.float64]


def places(mesh: SurfaceMesh) -> dict[str, Floats]:
    """Points near a mesh, and points anywhere around it, m, shape (n, 3)."""
    generator = np.random.default_rng(0)
    surface = trimesh.Trimesh(mesh.points, mesh.triangles, process=False)
    on, _ = trimesh.sample.sample_surface(surface, POINTS, seed=0)
    near = on + generator.uniform(-1e-3, 1e-3, size=on.shape)
    middle, half = mesh.points.mean(axis=0), np.ptp(mesh.points, axis=0)
    return {"near": near, "anywhere": middle + generator.uniform(-1, 1, size=on.shape) * half}


def true_distances(surface: trimesh.Trimesh, points: Floats) -> Floats:
    """Distance of the nearest of all triangles, m, shape (n,)."""
    corners = surface.triangles
    found = []
    for point in points:
        closest = trimesh.triangles.closest_point(
            corners, np.broadcast_to(point, (len(corners), 3))
        )
        found.append(np.linalg.norm(closest - point, axis=1).min())
    return np.array(found)


def microseconds(query: Callable[[Floats], object], points: Floats) -> float:
    """Time for a point; the best round counts."""
    query(points[:10])
    spent = []
    for _ in range(ROUNDS):
        started = process_time()
        query(points)
        spent.append(process_time() - started)
    return 1e6 * min(spent) / len(points)


def main() -> None:
    """Print µs for a point."""
    has_rtree = importlib.util.find_spec("rtree") is not None
    rows = []
    for segments in (48, 96, 192):
        mesh = wine_glass(segments)
        ours = ClosestPoint(mesh.points, mesh.triangles)
        surface = trimesh.Trimesh(mesh.points, mesh.triangles, process=False)
        for where, points in places(mesh).items():
            few = points[:FEWER]
            truth = true_distances(surface, few)
            row = [str(segments), str(len(mesh.triangles)), where]
            row.append(f"{microseconds(lambda x, q=ours: q(x.T), points):.2f}")
            row.append(f"{np.abs(ours(few.T)[1] - truth).max():.0e}")
            if has_rtree:
                theirs = trimesh.proximity.ProximityQuery(surface).on_surface
                row.append(f"{microseconds(theirs, few):.0f}")
                row.append(f"{np.abs(theirs(few)[1] - truth).max():.0e}")
            else:
                row += ["–", "–"]
            rows.append(row)
    costs = ["libigl, µs", "off, m", "trimesh, µs", "off, m"]
    print(table(["segments", "triangles", "points", *costs], rows))
    if not has_rtree:
        print("\ntrimesh was not measured: its query needs rtree (pip install rtree)")


if __name__ == "__main__":
    main()
