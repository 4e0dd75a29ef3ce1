"""Make the lung surface meshes in ``scenarios/meshes``.

The shape is the human lung scaffold of scaffoldmaker (``3D Lung 2``, parameter set
``Human 1``).  It is sampled finely, thinned to the wanted number of points and evened out
(`even_mesh.py`), because an explicit time step is limited by the smallest and the most
connected point.  Each run gives the same files.  Needs its own environment (Python 3.11)::

    pip install scaffoldmaker==0.21.0 trimesh==5.2.0 rtree==1.4.1 networkx numpy scipy
    python tools/make_lung_meshes.py --out scenarios/meshes
"""

import argparse
from importlib.metadata import version
from pathlib import Path

import numpy as np
import trimesh
from cmlibs.zinc.context import Context
from even_mesh import even_mesh
from scaffoldmaker.meshtypes.meshtype_3d_lung2 import MeshType_3d_lung2

PARAMETER_SET = "Human 1"
VOLUME = 1.25e-3  # volume inside a mesh, m^3
HEADINGS = (
    *("File", "Shortest edge", "Longest edge", "Smallest angle", "Edges at a point"),
    *("Smallest area", "Volume", "Distance"),
)


def scaffold_surface(side: str, samples: int) -> trimesh.Trimesh:
    """Sample the surface of one lung of the scaffold.

    Parameters
    ----------
    side : {"left", "right"}
        Which lung.
    samples : int
        Steps along each side of a face of the scaffold.

    Returns
    -------
    trimesh.Trimesh
        The surface in metres, wound outward, z up, `normalised`.
    """
    context = Context("lung")  # this and the annotations must stay alive while they are used
    region = context.getDefaultRegion()
    options = MeshType_3d_lung2.getDefaultOptions(PARAMETER_SET)
    annotations = MeshType_3d_lung2.generateMesh(region, options)[0]
    module = region.getFieldmodule()
    coordinates = module.findFieldByName("coordinates").castFiniteElement()
    exterior, cache = module.createFieldIsExterior(), module.createFieldcache()
    lung = next(group for group in annotations if group.getName() == f"{side} lung")
    faces = lung.getMeshGroup(module.findMeshByDimension(2)).createElementiterator()
    steps = np.linspace(0.0, 1.0, samples + 1).tolist()
    sampled = []
    while (face := faces.next()).isValid():
        cache.setElement(face)
        if exterior.evaluateReal(cache, 1)[1] == 1.0:
            for xi in ([a, b] for a in steps for b in steps):
                cache.setMeshLocation(face, xi)
                sampled.append(coordinates.evaluateReal(cache, 3)[1])
    points, index = np.unique(np.round(sampled, 6), axis=0, return_inverse=True)
    grid = index.reshape(-1, samples + 1, samples + 1)
    corners = grid[:, :-1, :-1], grid[:, 1:, :-1], grid[:, 1:, 1:], grid[:, :-1, 1:]
    a, b, c, d = (corner.ravel() for corner in corners)
    triangles = np.vstack([np.c_[a, b, c], np.c_[a, c, d]])
    solid = (np.diff(np.sort(triangles, axis=1), axis=1) > 0).all(axis=1)  # some faces taper off
    surface = trimesh.Trimesh(points, triangles[solid], process=False)
    trimesh.repair.fix_normals(surface)  # the faces of the scaffold are wound either way
    return normalised(surface)


def normalised(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Put the centroid of the body inside at the origin and scale the body to `VOLUME`."""
    mesh.apply_translation(-mesh.center_mass)
    return mesh.apply_scale((VOLUME / mesh.volume) ** (1.0 / 3.0))


def quality(mesh: trimesh.Trimesh, surface: trimesh.Trimesh) -> list[str]:
    """Check that `mesh` is sound and measure it before the final scaling.

    Parameters
    ----------
    mesh : trimesh.Trimesh
        The mesh made from `surface`.
    surface : trimesh.Trimesh
        The fine surface of the scaffold.

    Returns
    -------
    list of str
        Cells for the `HEADINGS` after the first.  Lengths and areas (a third of the faces at
        a point) are relative to the median; the distance is the largest one either way.
    """
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2
    assert len(np.unique(np.round(mesh.vertices, 6), axis=0)) == len(np.unique(mesh.faces))
    edges = mesh.edges_unique_length / np.median(mesh.edges_unique_length)
    areas = np.bincount(mesh.faces.ravel(), np.repeat(mesh.area_faces, 3))
    spots = np.vstack([mesh.vertices, mesh.triangles_center])
    away = mesh.nearest.on_surface(surface.vertices)[1], surface.nearest.on_surface(spots)[1]
    return [
        f"{edges.min():.2f}",
        f"{edges.max():.2f}",
        f"{np.degrees(mesh.face_angles.min()):.1f}°",
        f"{mesh.vertex_degree.min()} to {mesh.vertex_degree.max()}",
        f"{areas.min() / np.median(areas):.2f}",
        f"{100.0 * (mesh.volume / VOLUME - 1.0):+.2f} %",
        f"{1e3 * max(np.max(gaps) for gaps in away):.2f} mm",
    ]


def write_ply(path: Path, mesh: trimesh.Trimesh, side: str) -> None:
    """Write `mesh`, the lung on `side`, as an ASCII PLY file with nine significant digits."""
    made_by = f"scaffoldmaker {version('scaffoldmaker')}, 3D Lung 2, {PARAMETER_SET}"
    rows = [
        *("ply", "format ascii 1.0", f"comment {side} lung, metres, x right, y front, z up"),
        f"comment made by tools/make_lung_meshes.py from {made_by}",
        "comment scaffoldmaker is under the Apache-2.0 licence, see LICENCE-NOTE.md",
        f"element vertex {len(mesh.vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        *(f"element face {len(mesh.faces)}", "property list uchar int vertex_indices"),
        "end_header",
        *(" ".join(f"{x:.9g}" for x in point) for point in mesh.vertices.tolist()),
        *(" ".join(map(str, [3, *face])) for face in mesh.faces.tolist()),
    ]
    path.write_text("\n".join(rows) + "\n", encoding="ascii", newline="\n")


def main() -> None:
    """Write the files and print a table of their quality."""
    parser = argparse.ArgumentParser(description="Make the lung surface meshes.")
    parser.add_argument("--out", type=Path, default=Path("scenarios/meshes"))
    parser.add_argument("--counts", type=int, nargs="+", default=[770, 1730, 3074])
    parser.add_argument("--samples", type=int, default=14, help="steps along a scaffold face")
    parser.add_argument("--rounds", type=int, default=60, help="rounds of flips and relaxation")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    print("| " + " | ".join(HEADINGS) + " |\n|" + " --- |" * len(HEADINGS))
    for side in ("left", "right"):
        surface = scaffold_surface(side, chosen.samples)
        for count in chosen.counts:
            mesh = even_mesh(surface, count, chosen.rounds)
            path = chosen.out / f"lung-{side}-{count}.ply"
            print("| " + " | ".join([path.name, *quality(mesh, surface)]) + " |", flush=True)
            write_ply(path, normalised(mesh), side)


if __name__ == "__main__":
    main()
