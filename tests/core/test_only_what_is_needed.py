"""What a scene does not ask for costs nothing: counted in calls and bytes, not in time."""

from __future__ import annotations

import tracemalloc
from functools import cached_property
from inspect import getattr_static
from math import ceil
from unittest.mock import patch

import numpy as np
import pytest
import scipy.sparse.linalg

from softbody_core import (
    FORCES,
    INTEGRATORS,
    AirwayResistance,
    Gravity,
    InternalPressure,
    MassSpring,
    SoftBody,
    SoftBodyModel,
    State,
    SurfaceSPH,
    Weights,
    fibonacci_sphere,
)
from softbody_core.configuration import Configuration
from softbody_core.forces import BoundLaw, ResistanceLaw, mass_spring, surface_sph
from softbody_core.forces.pair_geometry import PairGeometry
from softbody_core.forces.volume_law import BoundResistance
from softbody_core.integrators.constant_operator import ConstantOperator
from softbody_core.integrators.explicit import RECHECK, ExplicitIntegrator
from softbody_core.state import Inputs

MESH = fibonacci_sphere(200, 0.08)
SPRINGS, PRESSURE = MassSpring(200.0, 0.1), InternalPressure(1e-3)
FLUID, AIRWAY = SurfaceSPH(30.0, 0.5), AirwayResistance(5e5)
EXPLICIT = [name for name, kind in INTEGRATORS.items() if issubclass(kind, ExplicitIntegrator)]
each_scheme = pytest.mark.parametrize("name", INTEGRATORS)


@pytest.fixture
def counted(monkeypatch):
    """Count the calls of a function, a method or a lazy property from now on."""

    def count(owner, name):
        original, calls = getattr_static(owner, name), []
        lazy = isinstance(original, cached_property)
        function = original.func if lazy else original

        def counting(*arguments, **options):
            calls.append(arguments)
            return function(*arguments, **options)

        replacement = cached_property(counting) if lazy else counting
        if lazy:
            replacement.__set_name__(owner, name)
        monkeypatch.setattr(owner, name, replacement)
        return calls

    return count


def body(laws, name="symplectic-euler", weights=None, **options):
    return SoftBody(SoftBodyModel(MESH, 0.5, laws, weights), INTEGRATORS[name](**options))


@pytest.mark.parametrize("name", INTEGRATORS)
def test_a_force_of_weight_zero_leaves_nothing_behind(name, counted):
    laws = [SPRINGS, FLUID, PRESSURE, Gravity(), AirwayResistance(0.0)]
    bindings = {law: counted(law, "bind") for law in FORCES.values()}
    searches = [counted(surface_sph, "NeighbourList"), counted(surface_sph, "PairGeometry")]
    with patch("softbody_core.neighbours.cKDTree") as tree:
        one = body(laws, name, Weights(beta=0, gamma=0, delta=0))
        for _ in range(3):
            one.step(0.01)
        tree.assert_not_called()
    assert {law for law, calls in bindings.items() if calls} == {MassSpring}
    assert searches == [[], []]
    assert [type(term).__name__ for _, term in one.model.terms] == ["_BoundMassSpring"]


def test_neighbours_are_searched_when_points_have_moved_far_enough():
    with patch("softbody_core.neighbours.cKDTree", wraps=scipy.spatial.cKDTree) as tree:
        one = body([SPRINGS, FLUID])
        assert tree.call_count == 1
        kick = np.random.default_rng(0).normal(size=(3, 200))
        one.state = State(0.0, one.state.positions, 0.01 * kick)  # 0.1 mm in all, of 1 mm of skin
        one.step(0.01)
        assert one.counters.steps > 5
        assert tree.call_count == 1


@pytest.mark.parametrize(("viscosity", "looks"), [(0.0, 1), (0.5, 2)])
def test_a_fluid_without_viscosity_does_not_look_at_velocities(viscosity, looks, counted):
    one = body([SPRINGS, SurfaceSPH(30.0, viscosity)])
    differences, sums = counted(PairGeometry, "differences"), counted(PairGeometry, "onto_ends")
    here = Configuration(MESH, one.state.positions)
    one.model.force(here, one.state.velocities, Inputs())
    assert (len(differences), len(sums)) == (looks, 1)


@pytest.mark.parametrize(("damping", "scatters"), [(0.0, 1), (0.1, 2)])
def test_springs_without_damping_do_not_look_at_velocities(damping, scatters, counted):
    one = body([MassSpring(200.0, damping)])
    calls = counted(mass_spring, "scatter")
    here = Configuration(MESH, one.state.positions)
    one.model.force(here, one.state.velocities, Inputs())
    assert len(calls) == scatters


@each_scheme
@pytest.mark.parametrize("airway", [None, AIRWAY], ids=["open", "resisting"])
def test_without_an_airway_nothing_resists(name, airway, counted):
    calls = [counted(BoundResistance, m) for m in ("force", "rates", "rank_one_damping")]
    calls += [counted(AirwayResistance, "resistance_at"), counted(ResistanceLaw, "bind")]
    body([SPRINGS, PRESSURE, airway] if airway else [SPRINGS, PRESSURE], name).step(0.02, 200.0)
    assert any(calls) == (airway is not None)


@pytest.mark.parametrize("name", EXPLICIT)
def test_geometry_that_nobody_reads_is_not_computed(name, counted):
    """The volume is computed without pressure or airway too: divergence shows in it."""
    read = ["edge_vectors", "edge_lengths", "volume_gradient", "volume"]
    calls = {part: counted(Configuration, part) for part in [*read, "bounding_box"]}
    one = body([SPRINGS], name, max_substep=1e-4)
    one._stepper.advance(one.state, Inputs(), 0.001)
    assert one.counters.steps == 10
    assert not calls["bounding_box"]
    # once for each evaluation of the springs, and never twice at one place
    assert len(calls["edge_lengths"]) == one.counters.force_evaluations
    assert len(calls["edge_vectors"]) == len(calls["edge_lengths"])
    # before the first substep, and after each
    assert len(calls["volume_gradient"]) == len(calls["volume"]) == 11


@pytest.mark.parametrize(("name", "evaluations", "first"), [
    ("symplectic-euler", 1, 0),
    ("velocity-verlet", 1, 1),  # each row of substeps starts with the force at its start
    ("rk4", 4, 0),
])  # fmt: skip
def test_a_substep_costs_its_force_evaluations_and_no_more(name, evaluations, first, counted):
    forces = {law: counted(type(law.bind(MESH, np.ones(200))), "force") for law in (SPRINGS, FLUID)}
    one = body([SPRINGS, FLUID], name, max_substep=1e-4)
    one.step(0.02)
    assert one.counters.steps == 200
    rows = ceil(200 / RECHECK)
    for calls in forces.values():
        assert len(calls) == 200 * evaluations + rows * first == one.counters.force_evaluations


@each_scheme
def test_what_only_analysis_asks_for_is_not_computed(name, counted):
    """Energies; and the largest eigenvalue is for explicit limits alone."""
    laws = [SPRINGS, FLUID, PRESSURE, AIRWAY]
    kinds = {type(law.bind(MESH, np.ones(200))) for law in laws} | {BoundLaw}
    calls = [counted(kind, "energy") for kind in kinds if "energy" in vars(kind)]
    eigenvalues = counted(scipy.sparse.linalg, "eigsh")
    factorizations = counted(scipy.sparse.linalg, "splu")
    one = body(laws, name)
    for _ in range(3):
        one.step(0.02, 200.0, 2000.0)
    assert not any(calls)
    assert len(eigenvalues) == (name in EXPLICIT)
    assert bool(factorizations) == (name not in EXPLICIT)


@pytest.mark.parametrize(
    ("name", "sizes"),
    [("backward-euler", 1), ("sdirk2", 1), ("bdf2", 2), ("quasi-static", 1)],
)
def test_a_run_at_a_constant_step_factors_once(name, sizes, counted):
    """BDF2 starts with a step of backward Euler, whose matrix is another."""
    factorizations = counted(scipy.sparse.linalg, "splu")
    solved = counted(ConstantOperator, "solve")
    loose = {} if name == "quasi-static" else {"tolerance": 10.0, "max_iterations": 100}
    one = body([SPRINGS, FLUID, PRESSURE, AIRWAY], name, **loose)
    for _ in range(40):
        one.step(1 / 60, 200.0, 2000.0)
    assert one.counters.steps == 40
    assert len(solved) > 30
    assert len(factorizations) == sizes


def peak_of(function):
    """Bytes that a call needs beside what it keeps from call to call."""
    function(), function()
    tracemalloc.start()
    try:
        function()  # what it replaces is traced from here on
        before, _ = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        function()
        return tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()


def test_a_steady_step_allocates_its_results_alone():
    """Results are (3, n). What lies on edges, (m,) or (3, m) with m = 3n, is one or three of them.

    So half a result of slack shows the smallest array that is made anew; what Python itself needs
    is a hundredth.
    """
    mesh, slack = fibonacci_sphere(2000, 0.08), 0.5
    laws = [SPRINGS, PRESSURE, Gravity(), FLUID]
    masses = 0.5 * mesh.point_areas / mesh.area
    state, inputs = State.at_rest(mesh), Inputs(200.0, 2000.0)
    here, result = Configuration(mesh, state.positions), state.positions.nbytes
    assert 8 * len(mesh.edges) == pytest.approx(result, rel=0.01)

    def geometry():
        here.move_to(state.positions)
        return here.edge_lengths, here.volume

    # the new gradient takes the place of the old one
    assert peak_of(geometry) < slack * result
    springs, pressure, gravity, fluid = (law.bind(mesh, masses) for law in laws)

    def results_of(force):
        return peak_of(lambda: force.force(here, state.velocities, inputs)) / result

    assert results_of(springs) < 2 + slack  # pull and drag
    assert results_of(pressure) < 1 + slack
    assert results_of(gravity) < slack
    # np.repeat cannot write in place: one array of all pairs; beside it two values a point
    pairs = fluid._geometry.vectors.nbytes / result
    assert results_of(fluid) < pairs + 2 / 3 + slack

    def results_of_step(laws):
        stepper = INTEGRATORS["symplectic-euler"]().bind(SoftBodyModel(mesh, 0.5, laws))
        march = stepper._march(state, inputs, 1e-6)
        return peak_of(lambda: next(march)) / result

    # positions, velocities, and two at work: a force and its sum, or the gradient and a product
    assert results_of_step(laws[:3]) < 4 + slack
    # at its peak, the fluid's, there are two: the sum and the last law's force
    assert results_of_step(laws) < pairs + 2 / 3 + 2 + slack


def test_rk4_looks_at_no_place_twice(counted):
    one = body([SPRINGS, PRESSURE], "rk4", max_substep=1e-4)
    looked = counted(Configuration, "_edge_ends")
    one._stepper.advance(one.state, Inputs(delta_p=100.0), 0.001)
    assert one.counters.force_evaluations == 40
    assert len(looked) <= 40 + 2  # and twice for the limit, and for where the body ends


@pytest.mark.parametrize("name", EXPLICIT)
def test_without_gas_no_box_is_measured(name, counted):
    one = body([SPRINGS, PRESSURE], name)
    boxes = counted(Configuration, "bounding_box")
    one._stepper.advance(one.state, Inputs(delta_p=100.0), 0.001)
    assert not boxes
