"""The body: the one object that changes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.ground.arrays import Floats
from softbody_core.ground.errors import ParameterError
from softbody_core.integrators import Counters, Integrator, VelocityVerlet
from softbody_core.model import SoftBodyModel
from softbody_core.observation import Observation
from softbody_core.stability import check_state
from softbody_core.state import Inputs, State
from softbody_core.weights import Weights


@dataclass(frozen=True, eq=False)
class SavedBody:
    """Everything that a body needs to go on from where it stood."""

    state: State
    inputs: Inputs
    weights: Weights
    counters: Counters
    stepper: object
    projections: tuple[object, ...]


class SoftBody:
    """A model, an integrator, and where the body stands.

    Parameters
    ----------
    model : SoftBodyModel
        Surface, forces and constraints.
    integrator : Integrator, optional
        Velocity Verlet by default.

    Raises
    ------
    ParameterError
        If the integrator neglects inertia and a constraint needs it: what an obstacle does to a
        body is an impulse.

    Examples
    --------
    >>> from softbody_core import InternalPressure, MassSpring, SoftBody, SoftBodyModel, icosphere
    >>> laws = [MassSpring(stiffness=375.0, damping=0.1), InternalPressure(gas_energy=2e-3)]
    >>> body = SoftBody(SoftBodyModel(icosphere(2, radius=0.084), mass=1.0, forces=laws))
    >>> rest = body.observe().volume
    >>> bool(body.step(0.02, delta_p=500.0).volume > rest)
    True
    """

    def __init__(self, model: SoftBodyModel, integrator: Integrator | None = None) -> None:
        self.model = model
        self.integrator: Integrator = integrator if integrator is not None else VelocityVerlet()
        if model.projections and self.integrator.order is None:
            raise ParameterError(
                f"{type(self.integrator).__name__} neglects inertia, and so cannot keep a body "
                "from passing an obstacle or a largest volume; take any other integrator, such as "
                "sdirk2"
            )
        self._stepper = self.integrator.bind(model)
        self.state = State.at_rest(model.mesh)
        for projection in model.projections:
            self.state = projection.start(self.state)
        self._inputs = Inputs()
        self._start = self.get_state()
        self._checked = self.state

    def step(self, dt: float, delta_p: float = 0.0, n: float = 0.0) -> Observation:
        """Move on by one communication step.

        Parameters
        ----------
        dt : float
            Length of the step, s. The integrator divides it as stability needs.
        delta_p : float
            Pressure difference across the wall, Pa, positive outward, held over the step.
        n : float
            Number proportional to the molecules inside, held over the step.

        Returns
        -------
        Observation
            The body at the end of the step.

        Raises
        ------
        ParameterError
            If dt is not positive, or an input is not finite, or n is negative.
        DivergenceError, StepLimitError
            If the step fails. The body then stands where it stood before the call.
        """
        if not (np.isfinite(dt) and dt > 0):
            raise ParameterError(f"dt = {dt} s: expected a positive number")
        inputs = Inputs(delta_p=delta_p, n=n)
        self._accept_new_state()
        before = self.get_state()
        try:
            self._relate_weights()
            self.state = self._checked = self._advance(self.state, inputs, dt)
            self._inputs = inputs
            return self.observe()
        except Exception:
            self.set_state(before)
            raise

    def _relate_weights(self) -> None:
        """Relations of C among α, β, γ and δ hold over the whole communication step."""
        if self.model.has_relations:
            self._take_weights(self.model.related(self.observe()))

    def _advance(self, state: State, inputs: Inputs, dt: float) -> State:
        """One step of S3D = ⟨O, F, V, N, C⟩, in as many parts as its constraints ask for.

        F moves the points: eq. 1 and F_i/m_i are the model's, what an integrator does with them is
        its stepper's. C corrects the positions O and the velocities V. This splitting is of first
        order, whatever the integrator, while a constraint acts.
        """
        end, remaining = state.time + dt, 1.0  # a share of dt, so that rounding adds no part
        while remaining > 0:
            parts = self._parts(state, remaining * dt)
            after = self._stepper.advance(state, inputs, remaining * dt / parts)
            for projection in self.model.projections:
                after = projection.project(state, after)
            state = after
            remaining = 0.0 if parts == 1 else remaining * (1 - 1 / parts)
        return state if state.time == end else replace(state, time=end)

    def _parts(self, state: State, ahead: float) -> int:
        """Into how many inner steps constraints divide the time ahead, s."""
        steps = (p.longest_step(state, ahead) for p in self.model.projections)
        longest = min(steps, default=ahead)
        return max(1, math.ceil(ahead / longest * (1 - 1e-12)))

    def _take_weights(self, weights: Weights) -> None:
        """Go on under other weights. A stepper starts afresh: its past was another body's."""
        if weights != self.model.weights:
            counters = self.counters
            self.model = self.model.reweighted(weights)
            self._stepper = self.integrator.bind(self.model)
            self._stepper.counters.reset_to(counters)

    def _accept_new_state(self) -> None:
        """Look at a state that was put in place from outside, and let the stepper start afresh."""
        if self.state is not self._checked:
            check_state(self.state, self.model)
            self._set_memories(self._start)  # what is remembered is of another state
            self._checked = self.state

    def observe(self) -> Observation:
        """Look at the body as it stands, under the inputs of its last step."""
        state, projections = self.state, self.model.projections
        configuration = Configuration(self.model.mesh, state.positions)
        pressure = self.model.pressure(configuration, self._inputs)
        flow = float(np.vdot(configuration.volume_gradient, state.velocities))
        return Observation(
            time=state.time,
            volume=configuration.volume,
            bounding_box=configuration.bounding_box,
            bounding_box_volume=configuration.bounding_box_volume,
            pressure=pressure,
            flow=flow,
            alveolar_pressure=pressure - self.model.resistance(flow) * flow,
            clearance=min((p.clearance(state) for p in projections), default=np.inf),
            obstacles=state.obstacles,
        )

    @property
    def counters(self) -> Counters:
        """Copy of the counts of what the integrator has done."""
        return replace(self._stepper.counters)

    work = counters
    """The same; older name."""

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.state.time

    @property
    def positions(self) -> Floats:
        """Copy of the point positions, m, shape (n, 3)."""
        return self.state.positions.T.copy()

    @property
    def velocities(self) -> Floats:
        """Copy of the point velocities, m/s, shape (n, 3)."""
        return self.state.velocities.T.copy()

    def get_state(self) -> SavedBody:
        """Everything needed to come back to this point exactly."""
        return SavedBody(
            self.state,
            self._inputs,
            self.model.weights,
            self.counters,
            self._stepper.get_state(),
            tuple(projection.get_state() for projection in self.model.projections),
        )

    def set_state(self, saved: SavedBody) -> None:
        """Go back to a saved point, of this body or its twin. What follows repeats to the bit.

        Raises
        ------
        ParameterError
            If it is of a body with another number of points or obstacles.
        """
        if saved.state.positions.shape != self.state.positions.shape:
            raise ParameterError(
                f"the saved body has {saved.state.positions.shape[1]} points, this one has "
                f"{self.model.mesh.n_points}; restore into the body that was saved, or its twin"
            )
        check_state(saved.state, self.model)
        self._take_weights(saved.weights)
        self.state, self._inputs = saved.state, saved.inputs
        self._checked = saved.state
        self._stepper.counters.reset_to(saved.counters)
        self._set_memories(saved)

    def _set_memories(self, saved: SavedBody) -> None:
        self._stepper.set_state(saved.stepper)
        for projection, state in zip(self.model.projections, saved.projections, strict=True):
            projection.set_state(state)

    save, restore = get_state, set_state
    """The same; older names."""
