"""Bending stiffness: two triangles that share an edge are a hinge with a spring.

Grinspun, Hirani, Desbrun & Schröder 2003, "Discrete shells", eq. 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import scipy.sparse as sp

from softbody_core.configuration import Configuration, cross, scatter, take
from softbody_core.forces.law import BoundLaw, Law, Majorants, Rates
from softbody_core.ground.arrays import Floats, Integers
from softbody_core.ground.parameters import Quantity
from softbody_core.mesh import SurfaceMesh, difference_operator, per_component
from softbody_core.state import Inputs
from softbody_core.weights import Control

_COLLAPSED = 1e-6
"""Length, and area, over that at rest, below which a triangle turns no more: it has no normal."""


@dataclass(frozen=True)
class Bending(Law):
    """Hinges on the edges, with the angles of the mesh at rest.

    U = ½ D Σ_e w_e Δ_e²,  w_e = |e⁰|²/(A⁰₁ + A⁰₂),  Δ_e = θ_e − θ⁰_e

    over the edges e; A₁ and A₂ are the areas of an edge's triangles. θ is the angle between their
    normals, positive where the surface is convex. Δ is taken the short way round, so that U has no
    jump where a hinge folds through itself. A hinge resists with the moment
    w_e (D Δ_e + η dθ_e/dt). Angles know no size: a body that grows in shape does not bend.

    A flat net of equilateral triangles is a plate of flexural rigidity D and Poisson's ratio −1/3
    (Schmidt & Fraternali 2012, "Universal formulae for the limiting elastic energy of membrane
    networks"). An uneven net is stiffer, and no refinement changes that: by 5 to 8 % where points
    are up to a fifth of an edge off, in both directions.

    Parameters
    ----------
    stiffness : float
        D, N·m. A sheet of thickness h has Y h²/(12 (1 − ν²)), with Y in N/m as a `Membrane` has it.
    damping : float
        η, N·m·s. Over D it is the relaxation time.
    """

    control: ClassVar[Control | None] = Control.STRUCTURE

    stiffness: Annotated[float, Quantity("N.m", at_least=0)]
    damping: Annotated[float, Quantity("N.m.s", at_least=0)] = 0.0

    def bind(self, mesh: SurfaceMesh, masses: Floats) -> BoundLaw[Law]:
        """Put a hinge on each edge, at rest as the mesh stands."""
        return _BoundBending(self, mesh, masses)


class _Flap:
    """One of the two triangles of each hinge: edge e, and wing w, from the edge's start.

    A wing that moves by δ against its foot on the edge turns the flap by tilt · δ.

    Parameters
    ----------
    side : float
        1 if the outward normal is along e × w, −1 if it is against.
    rest_square : ndarray, shape (m,)
        |e⁰|², m².

    Attributes
    ----------
    foot : ndarray, shape (m,)
        Where the wing stands above the edge: 0 at its start, 1 at its end.
    normal : ndarray, shape (3, m)
        N = e × w, outward, m².
    tilt : ndarray, shape (3, m)
        |e| N/|N|²: unit normal over height, 1/m.
    """

    def __init__(self, side: float, rest_square: Floats) -> None:
        self.side, self._rest_square = side, rest_square
        self.wing, self.normal, self.tilt = np.empty((3, 3, len(rest_square)))

    def move_to(self, edge: Floats) -> None:
        """Take another edge, m, shape (3, m), after the wing has moved."""
        self.edge = edge
        self.square = np.maximum(_dot(edge, edge), _COLLAPSED**2 * self._rest_square)
        self.length = np.sqrt(self.square)
        self.foot = _dot(self.wing, edge) / self.square
        cross(edge, self.wing, self.normal, np.empty_like(self.square))
        self.normal *= self.side
        size, least = _dot(self.normal, self.normal), (_COLLAPSED * self._rest_square) ** 2
        self.size = np.maximum(size, least)
        np.multiply(self.length / self.size, self.normal, out=self.tilt)


class _Hinges:
    """The hinges of a surface in motion.

    The arms of a hinge reach from the start of its edge to the wing on its left, to the wing on its
    right, and to its end.

    Attributes
    ----------
    angle : ndarray, shape (m,)
        θ.
    gradient : ndarray, shape (3, 3, m)
        ∂θ/∂arms, component by component, 1/m.
    """

    def __init__(self, mesh: SurfaceMesh) -> None:
        rest_square = mesh.edge_lengths**2
        self.flaps = _Flap(1.0, rest_square), _Flap(-1.0, rest_square)
        self.ends, self.wings = mesh.edge_ends, _wings(mesh)
        self.gradient = np.empty((3, 3, len(rest_square)))
        self._start = np.empty((3, len(rest_square)))

    def move_to(self, configuration: Configuration) -> _Hinges:
        """Take other positions, and overwrite every array that was given out before."""
        take(configuration.positions, self.ends[0], self._start)
        for flap, wing in zip(self.flaps, self.wings, strict=True):
            take(configuration.positions, wing, flap.wing)
            flap.wing -= self._start
            flap.move_to(configuration.edge_vectors)
        left, right = self.flaps
        # |N₁||N₂| sin θ = −|e| N₁ · w₂
        sine = -left.length * _dot(left.normal, right.wing)
        self.angle = np.arctan2(sine, _dot(left.normal, right.normal))
        # −p₁, −p₂ and s₁ p₁ + s₂ p₂
        on_left, on_right, on_end = self.gradient.transpose(1, 0, 2)
        np.negative(left.tilt, out=on_left)
        np.negative(right.tilt, out=on_right)
        np.multiply(left.foot, left.tilt, out=on_end)
        on_end += right.foot * right.tilt
        return self

    def turn(self, d_arms: Floats) -> Floats:
        """Change of the angles as the arms change, shape (m,)."""
        return np.asarray(np.einsum("cam,cam->m", self.gradient, d_arms))


class _BoundBending(BoundLaw[Bending]):
    def __init__(self, law: Bending, mesh: SurfaceMesh, masses: Floats) -> None:
        super().__init__(law, mesh, masses)
        self._hinges = _Hinges(mesh)
        (start, end), (left, right) = self._hinges.ends, self._hinges.wings
        arms = np.stack([[start, left], [start, right], [start, end]])
        self._reach = difference_operator(arms.transpose(0, 2, 1).reshape(-1, 2), mesh.n_points)
        self._arms_of = per_component(self._reach) if law.damping else None
        self._gather = per_component(-self._reach.T.tocsr())
        self._loads = np.empty_like(self._hinges.gradient)
        self._rest = Configuration(mesh, np.ascontiguousarray(mesh.points.T))
        self._rest_angles = self._hinges.move_to(self._rest).angle
        doubled = sum(np.sqrt(flap.size) for flap in self._hinges.flaps)
        self._weights = 2 * mesh.edge_lengths**2 / doubled

    def force(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Floats:
        hinges = self._hinges.move_to(configuration)
        moments = self.law.stiffness * self._bend(hinges)
        if self._arms_of is not None:
            arms = scatter(self._arms_of, velocities).reshape(hinges.gradient.shape)
            moments += self.law.damping * hinges.turn(arms)
        moments *= self._weights
        np.multiply(moments, hinges.gradient, out=self._loads)
        return scatter(self._gather, self._loads)

    def energy(self, configuration: Configuration, inputs: Inputs) -> float:
        bend = self._bend(self._hinges.move_to(configuration))
        return 0.5 * self.law.stiffness * float(self._weights @ bend**2)

    def majorants(self) -> Majorants:
        # A hinge turns by p₁·δ₁ + p₂·δ₂. Along the mean normal the flaps add up; across it, and
        # that is little where the hinge is nearly flat, they differ.
        left, right = self._hinges.move_to(self._rest).flaps
        operator = sp.csr_array((len(self.masses), len(self.masses)))
        for share, sign in (
            (np.cos(self._rest_angles / 2), 1),
            (np.sin(self._rest_angles / 2), -1),
        ):
            on_left = left.length / np.sqrt(left.size)
            on_right = sign * right.length / np.sqrt(right.size)
            parts = [on_left, on_right, -(on_left * left.foot + on_right * right.foot)]
            turn = sp.hstack([sp.diags_array(part) for part in parts]) @ self._reach
            operator = operator + turn.T @ sp.diags_array(self._weights * share**2) @ turn
        operator = sp.csr_array(operator)
        return Majorants(self.law.stiffness * operator, self.law.damping * operator)

    def rates(self, configuration: Configuration, velocities: Floats, inputs: Inputs) -> Rates:
        # With a = |δ|/height of a flap and b = |d e|/|e|, the two flaps turn by at most a₁ + a₂,
        # and |d²θ| ≤ Σ (a² + 3 a b + b²) ≤ Σ 5/2 (a² + b²).
        hinges, law = self._hinges.move_to(configuration), self.law
        bend = np.abs(self._bend(hinges))
        return Rates(
            self._row_sum(hinges, law.stiffness * (2 + 2.5 * bend), law.stiffness * 5 * bend),
            self._row_sum(hinges, 2 * law.damping, 0.0),
        )

    def _row_sum(self, hinges: _Hinges, tilting: Floats | float, along: Floats | float) -> float:
        """Largest row sum of M⁻¹ Σ w (tilting Σ a² + along b²), 1/s² or 1/s."""
        n, (start, end) = len(self.masses), hinges.ends
        stretch = 2 * self._weights * along / hinges.flaps[0].square
        rows = np.bincount(start, stretch, n) + np.bincount(end, stretch, n)
        for flap, wing in zip(hinges.flaps, hinges.wings, strict=True):
            at_start, at_end = np.abs(1 - flap.foot), np.abs(flap.foot)
            pull = self._weights * tilting * (flap.square / flap.size) * (1 + at_start + at_end)
            rows += np.bincount(wing, pull, n)
            rows += np.bincount(start, pull * at_start, n) + np.bincount(end, pull * at_end, n)
        return float(np.max(rows / self.masses))

    def _bend(self, hinges: _Hinges) -> Floats:
        """Δ of each hinge, between −π and π, shape (m,)."""
        bend = hinges.angle - self._rest_angles
        return np.asarray(bend - 2 * np.pi * np.round(bend / (2 * np.pi)))


def _wings(mesh: SurfaceMesh) -> tuple[Integers, Integers]:
    """Points that face each edge from its left and from its right, seen from outside."""
    forward = mesh.triangles < mesh.triangles[:, [1, 2, 0]]
    opposite = mesh.triangles[:, [2, 0, 1]]
    left, right = np.empty((2, len(mesh.edges)), dtype=np.int64)
    left[mesh.triangle_edges[forward]] = opposite[forward]
    right[mesh.triangle_edges[~forward]] = opposite[~forward]
    return left, right


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("cm,cm->m", a, b))
