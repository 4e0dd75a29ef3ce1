"""Exact tangents of the laws: what their majorants and rates have to exceed.

Nothing in the core needs them. `TANGENTS` holds closed forms, one pair of functions a law; a test
compares them with differences of the force. A law without an entry is differenced, so that its
majorants and rates are tested all the same.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import scipy.sparse as sp

from softbody_core import Bending, Gravity, MassSpring, Membrane, SurfaceSPH
from softbody_core.configuration import cross
from softbody_core.forces import PressureLaw, ResistanceLaw
from tests.core.forces import jacobian

_STEP = 1e-6
"""Of differences, in m and m/s; bodies in tests are some 0.1 m."""


def stiffness(bound, configuration, inputs):
    """−∂F/∂x of the body at rest in a configuration, N/m, sparse, shape (3n, 3n)."""
    closed = _of(bound.law)
    if closed is not None:
        return sp.csr_array(closed[0](bound, configuration, inputs))
    kind, mesh, still = type(configuration), configuration.mesh, 0 * configuration.positions
    at = lambda x: bound.force(kind(mesh, x), still, inputs).copy()  # noqa: E731
    return sp.csr_array(-jacobian(at, configuration.positions, _STEP))


def damping(bound, configuration, velocities, inputs):
    """−∂F/∂v, N·s/m, sparse, shape (3n, 3n)."""
    closed = _of(bound.law)
    if closed is not None:
        return sp.csr_array(closed[1](bound, configuration, velocities))
    at = lambda v: bound.force(configuration, v, inputs).copy()  # noqa: E731
    return sp.csr_array(-jacobian(at, velocities, _STEP))


def is_closed(law):
    """Whether there is a closed form."""
    return _of(law) is not None


def _of(law):
    return next((TANGENTS[kind] for kind in type(law).__mro__ if kind in TANGENTS), None)


def _nothing(bound, *_):
    n = 3 * len(bound.masses)
    return sp.csr_array((n, n))


def _blocks(operator):
    """Assemble a (3n, 3n) matrix from its nine component blocks."""
    rows = [[operator(row, column) for column in range(3)] for row in range(3)]
    return sp.block_array(rows, format="csr")


def _dense(product, shape):
    """A linear map of (3, n) arrays as a matrix."""
    units = np.eye(int(np.prod(shape)))
    return np.array([product(unit.reshape(shape)).ravel() for unit in units]).T


def _edge_dampers(bound, *_):
    return sp.kron(sp.eye_array(3), bound.law.damping * bound.mesh.laplacian)


def _spring_stiffness(bound, configuration, inputs):
    difference, lengths = bound.mesh.edge_difference, configuration.edge_lengths
    along = configuration.edge_vectors / lengths
    across = bound.law.stiffness * (1 - bound.mesh.edge_lengths / lengths)

    def block(row, column):
        weights = (bound.law.stiffness - across) * along[row] * along[column]
        if row == column:
            weights += across
        return difference.T @ sp.diags_array(weights) @ difference

    return _blocks(block)


def _membrane_stiffness(bound, configuration, inputs):
    difference = bound.mesh.edge_difference
    tension = sp.diags_array(bound._joined @ bound._stretch(configuration))
    across = difference.T @ tension @ difference
    # ∂q/∂x, a block for each component
    change = [sp.diags_array(row) @ difference for row in configuration.edge_vectors]

    def block(row, column):
        along = change[row].T @ bound._joined @ change[column]
        return along + across if row == column else along

    return _blocks(block)


def _bending_stiffness(bound, configuration, inputs):
    hinges = bound._hinges.move_to(configuration)
    modulus = bound.law.stiffness * bound._weights
    moments = modulus * bound._bend(hinges)

    def load(d_arms):
        d_moments = modulus * hinges.turn(d_arms)
        return d_moments * hinges.gradient + moments * _gradient_change(hinges, d_arms)

    return _of_arms(bound, load)


def _bending_damping(bound, configuration, velocities):
    hinges = bound._hinges.move_to(configuration)
    modulus = bound.law.damping * bound._weights
    return _of_arms(bound, lambda d_arms: modulus * hinges.turn(d_arms) * hinges.gradient)


def _of_arms(bound, load):
    """Matrix of a linear map from what the arms move to what loads them, (3, 3, m) both."""
    loads = np.empty((3, 3, 3, 3, len(bound._weights)))  # component and arm, of load and move
    for component, arm in np.ndindex(3, 3):
        d_arms = np.zeros(loads.shape[2:])
        d_arms[component, arm] = 1.0
        loads[:, :, component, arm] = load(d_arms)

    def block(row, column):
        hinges = [[sp.diags_array(entry) for entry in arm] for arm in loads[row, :, column]]
        return bound._reach.T @ sp.block_array(hinges, format="csr") @ bound._reach

    return _blocks(block)


def _gradient_change(hinges, d_arms):
    """Change of a hinge's gradient as its arms change: ∂²θ/∂arms² times d_arms.

    In closed form after Tamstorf & Grinspun 2013, "Discrete bending forces and their Jacobians";
    here along a direction, from the arms of the hinge.
    """
    d_left, d_right, d_edge = d_arms.transpose(1, 0, 2)
    changes = np.zeros_like(hinges.gradient)
    for index, (flap, d_wing) in enumerate(zip(hinges.flaps, (d_left, d_right), strict=True)):
        d_tilt, d_foot = _flap_change(flap, d_edge, d_wing)
        changes[:, index] = -d_tilt
        changes[:, 2] += d_foot * flap.tilt + flap.foot * d_tilt
    return changes


def _flap_change(flap, d_edge, d_wing):
    """Change of a flap's tilt and of its foot."""
    edge, wing = flap.edge, flap.wing
    d_square = 2 * _dot(edge, d_edge)
    d_foot = (_dot(d_wing, edge) + _dot(wing, d_edge) - flap.foot * d_square) / flap.square
    d_normal = flap.side * (_cross(d_edge, wing) + _cross(edge, d_wing))
    collapsed = _dot(flap.normal, flap.normal) < flap.size
    d_size = np.where(collapsed, 0.0, 2 * _dot(flap.normal, d_normal))
    d_length = 0.5 * d_square / flap.length
    d_tilt = (d_length * flap.normal + flap.length * d_normal) / flap.size
    return d_tilt - (d_size / flap.size) * flap.tilt, d_foot


def _dot(a, b):
    return np.einsum("cm,cm->m", a, b)


def _cross(a, b):
    product = np.empty_like(a)
    cross(a, b, product, np.empty(a.shape[1]))
    return product


def _fluid_stiffness(bound, configuration, inputs):
    return -_dense(
        lambda u: _fluid_force_change(bound, configuration, u), configuration.positions.shape
    )


def _fluid_damping(bound, configuration, velocities):
    def product(u):
        geometry, _ = bound._fluid(configuration)
        return geometry.onto_ends(bound._drag(geometry, u))

    return _dense(product, configuration.positions.shape)


def _fluid_force_change(bound, configuration, u):
    """(∂F/∂x) u of the pressure force among points."""
    geometry, densities = bound._fluid(configuration)
    sign = 1.0 if bound.law.internal else -1.0
    vectors, lengths, gap = geometry.vectors, geometry.lengths, geometry.gap
    push = bound._push(geometry).copy()
    du = geometry.differences(u, np.empty_like(vectors))
    dr = np.einsum("cp,cp->p", vectors, du) / lengths
    d_density = bound._density_change(geometry, -bound._kernel_slope(lengths) * dr)
    # push = shares · mean · spiky · gap² / r, differentiated factor by factor
    first, second = geometry.at_ends(0.5 * bound.law.gas_constant * d_density)
    d_push = bound._spiky * bound._shares * (first + sign * second) * gap**2 / lengths
    first, second = geometry.at_ends(d_density / densities)
    d_push -= push * (first + second + dr / lengths)
    d_push -= 2 * bound._spiky * bound._shares * bound._mean_pressures * gap * dr / lengths
    return bound._pushed(geometry, d_push * vectors + push * du)


def _pressure_stiffness(bound, configuration, inputs):
    """−p ∂²V/∂x² − ∂V/∂x ∂p/∂x."""
    load = bound.law.share * bound.law.pressure(configuration, inputs)
    parts = bound.rank_one_stiffness(configuration, inputs)
    matrix = -load * _area_curvature(configuration)
    return sum((_outer(part) for part in parts), start=matrix)


def _resistance_damping(bound, configuration, velocities):
    return _outer(bound.rank_one_damping(configuration, velocities))


def _outer(part):
    return sp.csr_array(part.coefficient * np.outer(part.left.ravel(), part.right.ravel()))


def _area_curvature(configuration):
    """∂A/∂x = ∂²V/∂x², shape (3n, 3n): a third of ½[e_b]× from each triangle at b."""
    triangles, n = configuration.mesh.triangles, configuration.mesh.n_points
    rows, columns = np.repeat(triangles, 3, axis=1).ravel(), np.tile(triangles, 3).ravel()
    corner = configuration.positions[:, triangles]
    opposite = corner[:, :, [2, 0, 1]] - corner[:, :, [1, 2, 0]]
    entries = np.tile(opposite, 3).reshape(3, -1) / 6
    x, y, z = (sp.csr_array((part, (rows, columns)), shape=(n, n)) for part in entries)
    empty = sp.csr_array((n, n))
    blocks = [[empty, -z, y], [z, empty, -x], [-y, x, empty]]
    return _blocks(lambda row, column: blocks[row][column])


TANGENTS: Final = {
    MassSpring: (_spring_stiffness, _edge_dampers),
    Membrane: (_membrane_stiffness, _edge_dampers),
    Bending: (_bending_stiffness, _bending_damping),
    SurfaceSPH: (_fluid_stiffness, _fluid_damping),
    PressureLaw: (_pressure_stiffness, _nothing),
    ResistanceLaw: (_nothing, _resistance_damping),
    Gravity: (_nothing, _nothing),
}
"""Stiffness and damping in closed form, by the class of a law or that of a family of laws."""
