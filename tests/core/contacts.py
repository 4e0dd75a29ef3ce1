"""Bodies and obstacles that tests of contact share, and looks at them that the core does not use.

The core only asks for unsigned distances. Here, sides are told by winding numbers and by formulas.
"""

from __future__ import annotations

import igl
import numpy as np
import trimesh

from softbody_core import (
    INTEGRATORS,
    Contact,
    Gravity,
    InternalPressure,
    MassSpring,
    RigidBody,
    SoftBody,
    SoftBodyModel,
    SurfaceMesh,
    icosphere,
    revolved,
)

INERTIAL = [name for name, kind in INTEGRATORS.items() if getattr(kind, "order", None)]
GAS = 3e4
"""n that gives the ball of `soft_ball` some 250 Pa."""


def mesh_of(made):
    """A closed mesh of trimesh's."""
    return SurfaceMesh.from_arrays(made.vertices, made.faces, weld=True)


def slab(thickness=0.1, side=1.0, angle=0.0):
    """A box whose upper side is the plane z = 0, turned about the y-axis."""
    made = trimesh.creation.box((side, side, thickness))
    made.apply_translation((0, 0, -thickness / 2))
    made.apply_transform(trimesh.transformations.rotation_matrix(angle, (0, 1, 0)))
    return mesh_of(made)


def flask(radius=0.05, wall=1e-4, neck=1e-3, segments=48):
    """A hollow sphere of thin glass, open at the top by a neck finer than any soft mesh here."""
    inner = radius - wall
    up = np.linspace(-np.pi / 2, np.arccos(neck / inner), 40)[1:]
    circle = np.stack([np.cos(up), np.sin(up)], axis=1)
    profile = [(0, -radius), *(radius * circle), *(inner * circle[::-1]), (0, -inner)]
    return revolved([(float(r), float(z)) for r, z in profile], segments)


def soft_ball(obstacles=(), integrator="symplectic-euler", centre=(0, 0, 0.05), **options):
    """A ball of 3 cm and 30 g, of springs and gas, among obstacles."""
    scheme = options.pop("scheme", {})
    laws = options.pop("laws", [Gravity()])
    gas = options.pop("gas", InternalPressure(1e-6))
    springs = options.pop("springs", MassSpring(100.0, 0.05))
    mesh = options.pop("mesh", None) or icosphere(1, 0.03)
    before = options.pop("constraints", [])
    contact = Contact(tuple(obstacles), **options)
    forces = [springs, gas, *laws]
    model = SoftBodyModel(mesh.moved(centre), 0.03, forces, constraints=[*before, contact])
    return SoftBody(model, INTEGRATORS[integrator](**scheme))


def within(mesh, points):
    """How many points are in the material, by the solid angle it fills from there (Jacobson 2013).

    Exact sums over the triangles, in the world, of the surface that the body itself reports.
    """
    return int((igl.winding_number(mesh.points, mesh.triangles, points) > 0.5).sum())


def placed(body, index=0):
    """An obstacle's surface where it stands now."""
    law, there = body.model.obstacles[index], body.state.obstacles[index]
    return SurfaceMesh.from_arrays(law.surface(there), law.mesh.triangles)


def outside_all(body):
    """Whether no point is within any obstacle."""
    count = len(body.model.obstacles)
    return all(within(placed(body, i), body.positions) == 0 for i in range(count))


def momenta(body, about=(0.0, 0.0, 0.0)):
    """Linear and angular momentum of soft and rigid bodies together, about a point."""
    linear, angular = _momenta(body.model.masses, body.positions, body.velocities, about)
    for law, there in zip(body.model.obstacles, body.state.obstacles, strict=True):
        inertia = there.rotation @ law.inertia @ there.rotation.T
        linear = linear + law.mass * there.velocity
        angular = angular + np.cross(there.position - about, law.mass * there.velocity)
        angular = angular + inertia @ there.angular_velocity
    return linear, angular


def _momenta(masses, positions, velocities, about):
    carried = masses[:, None] * velocities
    return carried.sum(axis=0), np.cross(positions - about, carried).sum(axis=0)


def still(mesh, **options):
    """A fixed obstacle."""
    return RigidBody(mesh, **options)
