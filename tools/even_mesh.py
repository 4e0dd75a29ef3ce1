"""Turn a fine closed surface into an even triangle mesh with a given number of points.

Used by ``make_lung_meshes.py``, which names the packages to install.
"""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

CREASE_ANGLE = np.radians(40.0)  # edges of the fine surface sharper than this stay creases
RIDGE_ANGLE = np.radians(7.0)  # sharper edges that carry a crease straight on are kept, too
CORNER_COSINE = 0.5  # a crease that turns by more than 60 degrees has a corner there
LEAST, MOST = 4, 8  # fewest and most edges at a point that thinning and flips may leave
FREE, CREASE, CORNER = 0, 1, 2  # a point may slide anywhere, only along its crease, or not at all


@dataclass
class Net:
    """A closed triangle mesh that is being made even.

    Each point is `FREE`, `CREASE` or `CORNER` by `kinds`; `creases` are edges as two points.
    """

    points: NDArray[np.float64]
    faces: NDArray[np.int64]
    kinds: NDArray[np.int64]
    creases: set[frozenset[int]]

    def mesh(self) -> trimesh.Trimesh:
        """Return the mesh as it is now for trimesh, point by point."""
        return trimesh.Trimesh(self.points, self.faces, process=False)

    def crease_edges(self) -> NDArray[np.int64]:
        """Return the edges along creases, one a row, in a fixed order."""
        return np.array(sorted(sorted(edge) for edge in self.creases))


def even_mesh(surface: trimesh.Trimesh, count: int, rounds: int) -> trimesh.Trimesh:
    """Make an even mesh of `surface`.

    Parameters
    ----------
    surface : trimesh.Trimesh
        Closed and wound outward, with many more than `count` points.
    count : int
        Number of points of the result.
    rounds : int
        Rounds of edge flips and relaxation.

    Returns
    -------
    trimesh.Trimesh
        A mesh near `surface`, with its creases.
    """
    net = mark_creases(surface)
    rails = net.points[net.crease_edges()]
    thin(net, count)
    for _ in range(rounds):
        flip(net)
        relax(net, surface, rails)
    flip(net)
    for _ in range(2):
        fit(net, surface)
    return net.mesh()


def mark_creases(surface: trimesh.Trimesh) -> Net:
    """Find the creases of `surface`, and the corners where they end, meet or turn."""
    points, kinds = np.array(surface.vertices), np.full(len(surface.vertices), FREE)
    edges, angles = surface.face_adjacency_edges, surface.face_adjacency_angles
    kept = angles > CREASE_ANGLE
    pending = np.unique(edges[kept]).tolist()
    while pending:
        i = pending.pop()
        here = np.flatnonzero((edges == i).any(axis=1))
        arms = points[edges[here].sum(axis=1) - i] - points[i]
        arms /= np.linalg.norm(arms, axis=1, keepdims=True)
        on = kept[here]
        straight = arms @ arms[on][0]
        ahead = here[np.argmin(straight)]
        if np.count_nonzero(on) == 1 and straight.min() < -0.95 and angles[ahead] > RIDGE_ANGLE:
            kept[ahead] = True
            pending += edges[ahead].tolist()
            kinds[i] = CREASE
        else:
            smooth = np.count_nonzero(on) == 2 and straight[on].min() < -CORNER_COSINE
            kinds[i] = CREASE if smooth else CORNER
    creases = set(map(frozenset, edges[kept].tolist()))
    return Net(points, np.array(surface.faces), kinds, creases)


def thin(net: Net, count: int) -> None:
    """Merge the ends of the shortest edges, a few in each round, until `count` points remain."""
    while (excess := len(net.points) - count) > 0:
        flip(net)  # frees points that have too few or too many edges
        mesh = net.mesh()
        near = [set(row) for row in mesh.vertex_neighbors]
        around = [row[row >= 0] for row in mesh.vertex_faces]
        into, busy = np.arange(len(net.points)), set()
        allowed = min(excess, max(len(into) // 50, 1))
        order = np.argsort(mesh.edges_unique_length, kind="stable")
        for i, j in mesh.edges_unique[order].tolist():
            if allowed == 0:
                break
            if net.kinds[i] > net.kinds[j]:
                i, j = j, i  # point i goes, point j stays
            both, ring = near[i] & near[j], near[i] | near[j]
            along = net.kinds[i] == CREASE and {i, j} in net.creases
            if busy & ring or not (net.kinds[i] == FREE or along):
                continue
            fewest = min(len(near[k]) for k in both) - 1
            if len(both) != 2 or fewest < LEAST or len(ring) - 2 > MOST:
                continue
            kept = np.array([f for f in around[i] if j not in net.faces[f]])
            moved = np.where(net.faces[kept] == i, j, net.faces[kept])
            if turns_little(net, moved, mesh.face_normals[kept]):
                into[i] = j
                busy |= ring
                allowed -= 1
        stays = into == np.arange(len(into))
        if stays.all():
            raise ValueError(f"cannot thin the mesh below {len(into)} points")
        number = (np.cumsum(stays) - 1)[into]
        faces = number[net.faces]
        net.faces = faces[(np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)]
        net.points, net.kinds = net.points[stays], net.kinds[stays]
        merged = (frozenset(number[list(edge)].tolist()) for edge in net.creases)
        net.creases = {edge for edge in merged if len(edge) == 2}


def turns_little(net: Net, faces: NDArray[np.int64], normals: NDArray[np.float64]) -> bool:
    """Tell whether `faces` have an area and face within 60 degrees of all `normals` given."""
    new, solid = trimesh.triangles.normals(net.points[faces])
    return bool(solid.all()) and bool((np.sum(new * normals, axis=1) > 0.5).all())


def flip(net: Net) -> None:
    """Flip the edges, off creases, whose opposite angles add up to more than 180 degrees."""
    mesh = net.mesh()
    ends, tips = mesh.face_adjacency_edges, mesh.face_adjacency_unshared
    arms = [[net.points[ends[:, s]] - net.points[tips[:, t]] for s in (0, 1)] for t in (0, 1)]
    total = sum(trimesh.geometry.vector_angle(np.stack(pair, axis=1)) for pair in arms)
    worst = np.argsort(-total, kind="stable")[: np.count_nonzero(total > np.pi + 1e-6)]
    valence, edges = mesh.vertex_degree.copy(), set(map(frozenset, mesh.edges_unique.tolist()))
    busy: set[int] = set()
    for n in worst.tolist():
        (f, g), (i, j), (k, m) = mesh.face_adjacency[n].tolist(), ends[n].tolist(), tips[n].tolist()
        if busy & {f, g} or {i, j} in net.creases or {k, m} in edges:
            continue
        if valence[[i, j]].min() <= LEAST or valence[[k, m]].max() >= MOST:
            continue
        old = net.faces[[f, g]]
        new = np.array([np.where(old[0] == j, m, old[0]), np.where(old[1] == i, k, old[1])])
        normals = mesh.face_normals[[f, g]]
        if turns_little(net, new, normals) and turns_little(net, new, normals[::-1]):
            net.faces[[f, g]] = new
            busy |= {f, g}
            edges.add(frozenset((k, m)))
            valence[[i, j]] -= 1
            valence[[k, m]] += 1


def relax(net: Net, surface: trimesh.Trimesh, rails: NDArray[np.float64]) -> None:
    """Move each point half way to the middle of what is around it, free points on `surface`.

    Crease points stay on `rails`, the crease edges of the surface as pairs of positions.
    """
    mesh = net.mesh()
    weight, middle = np.zeros(len(net.points)), np.zeros_like(net.points)
    np.add.at(weight, net.faces, mesh.area_faces[:, None])
    np.add.at(middle, net.faces, (mesh.area_faces[:, None] * mesh.triangles_center)[:, None, :])
    step = 0.5 * (middle / weight[:, None] - net.points)
    step -= np.sum(step * mesh.vertex_normals, axis=1)[:, None] * mesh.vertex_normals
    free, bound = net.kinds == FREE, net.kinds == CREASE
    links, sums = net.crease_edges(), np.zeros_like(net.points)
    np.add.at(sums, links, net.points[links[:, ::-1]])
    goals = 0.5 * net.points[bound] + 0.25 * sums[bound]  # a crease point has two neighbours
    start, along = rails[:, 0], rails[:, 1] - rails[:, 0]
    part = np.sum((goals[:, None] - start) * along, axis=2) / np.sum(along**2, axis=1)
    spots = start + np.clip(part, 0.0, 1.0)[:, :, None] * along
    best = np.argmin(np.linalg.norm(spots - goals[:, None], axis=2), axis=1)
    net.points[bound] = spots[np.arange(len(best)), best]
    net.points[free] = surface.nearest.on_surface((net.points + step)[free])[0]


def fit(net: Net, surface: trimesh.Trimesh) -> None:
    """Move free points along their normals so that the faces, not only they, lie on `surface`."""
    mesh = net.mesh()
    spots, _, hit = mesh.nearest.on_surface(surface.vertices)
    shares = trimesh.triangles.points_to_barycentric(mesh.triangles[hit], spots)
    weight, move = np.zeros(len(net.points)), np.zeros(len(net.points))
    gaps = np.sum((surface.vertices - spots)[:, None] * mesh.vertex_normals[net.faces[hit]], axis=2)
    np.add.at(weight, net.faces[hit], shares)
    np.add.at(move, net.faces[hit], shares * gaps)
    move[net.kinds != FREE] = 0.0
    net.points += (move / np.maximum(weight, 1e-9))[:, None] * mesh.vertex_normals
