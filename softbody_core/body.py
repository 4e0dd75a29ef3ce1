"""The body: the one object that changes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from softbody_core.configuration import Configuration
from softbody_core.ground.arrays import Floats
from softbody_core.ground.errors import ParameterError
from softbody_core.integrators import Integrator, VelocityVerlet, Work
from softbody_core.integrators.restrained import bind
from softbody_core.model import SoftBodyModel
from softbody_core.observation import Observation
from softbody_core.stability import check_finite, check_volume
from softbody_core.state import Inputs, State
from softbody_core.weights import Weights


@dataclass(frozen=True, eq=False)
class SavedBody:
    """Everything that a body needs to go on from where it stood."""

    state: State
    inputs: Inputs
    weights: Weights
    work: Work
    memory: object


class SoftBody:
    """A model, an integrator, and where the body stands.

    Parameters
    ----------
    model : SoftBodyModel
        Surface, forces and constraints.
    integrator : Integrator, optional
        Scheme; velocity Verlet by default.

    Examples
    --------
    >>> from softbody_core import InternalPressure, MassSpring, SoftBody, SoftBodyModel, ball
    >>> laws = [MassSpring(stiffness=375.0, damping=0.1), InternalPressure(gas_energy=2e-3)]
    >>> body = SoftBody(SoftBodyModel(ball(162, radius=0.084), mass=1.0, forces=laws))
    >>> rest = body.observe().volume
    >>> bool(body.step(0.02, delta_p=500.0).volume > rest)
    True
    """

    def __init__(self, model: SoftBodyModel, integrator: Integrator | None = None) -> None:
        self.model = model
        self.integrator: Integrator = integrator if integrator is not None else VelocityVerlet()
        self._stepper = bind(self.integrator, model)
        self._at_start = self._stepper.memory()
        self.state = State.at_rest(model.mesh)
        for restraint in model.restraints:
            self.state = restraint.start(self.state)
        self._inputs = Inputs()
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
        self._check_new_state()
        model, stepper = self.model, self._stepper
        if model.has_relations:
            self._take_weights(model.related(self.observe()))
        memory, work = self._stepper.memory(), self.work
        try:
            state = self._stepper.advance(self.state, inputs, dt)
        except Exception:
            self._stepper.recall(memory)
            self._stepper.work.reset_to(work)
            self.model, self._stepper = model, stepper
            raise
        seen = self._look_at(state, inputs)
        self.state, self._inputs = state, inputs
        self._checked = state
        return seen

    def _take_weights(self, weights: Weights) -> None:
        """Go on under other weights. A scheme starts afresh then: its past was another body's."""
        if weights != self.model.weights:
            work = self.work
            self.model = self.model.reweighted(weights)
            self._stepper = bind(self.integrator, self.model)
            self._stepper.work.reset_to(work)

    def _check_new_state(self) -> None:
        """Look at a state that was put in place from outside, and start the scheme afresh."""
        if self.state is not self._checked:
            self._check(self.state)
            self._stepper.recall(self._at_start)  # what a scheme remembers is of another state
            self._checked = self.state

    def _check(self, state: State) -> None:
        """Refuse a state that is no body."""
        expected = self.model.masses.shape[0]
        for name, values in (("positions", state.positions), ("velocities", state.velocities)):
            if values.shape != (3, expected):
                raise ParameterError(
                    f"state.{name} have shape {values.shape}; expected (3, {expected})"
                )
        if len(state.obstacles) != len(self.model.obstacles):
            raise ParameterError(
                f"the state has {len(state.obstacles)} obstacles, the body "
                f"{len(self.model.obstacles)}; change the body's own state, as with "
                "dataclasses.replace(body.state, positions=…)"
            )
        check_finite(state)
        check_volume(state.time, Configuration(self.model.mesh, state.positions))

    def observe(self) -> Observation:
        """Look at the body as it stands, under the inputs of its last step."""
        return self._look_at(self.state, self._inputs)

    def _look_at(self, state: State, inputs: Inputs) -> Observation:
        here = Configuration(self.model.mesh, state.positions)
        pressure = self.model.pressure(here, inputs)
        flow = float(np.vdot(here.volume_gradient, state.velocities))
        return Observation(
            time=state.time,
            volume=here.volume,
            bounding_box=here.bounding_box,
            bounding_box_volume=here.bounding_box_volume,
            pressure=pressure,
            flow=flow,
            alveolar_pressure=pressure - self.model.resistance * flow,
            clearance=min((one.clearance(state) for one in self.model.restraints), default=np.inf),
            obstacles=state.obstacles,
        )

    @property
    def work(self) -> Work:
        """Copy of the counts of what the integrator has done."""
        return replace(self._stepper.work)

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

    def save(self) -> SavedBody:
        """Everything needed to come back to this point exactly."""
        return SavedBody(
            self.state, self._inputs, self.model.weights, self.work, self._stepper.memory()
        )

    def restore(self, saved: SavedBody) -> None:
        """Go back to a saved point. What follows repeats to the bit."""
        if saved.state.positions.shape != self.state.positions.shape:
            raise ParameterError(
                f"the saved body has {saved.state.positions.shape[1]} points, this one has "
                f"{self.model.mesh.n_points}; restore into the body that was saved, or its twin"
            )
        self._check(saved.state)
        self._take_weights(saved.weights)
        self.state, self._inputs = saved.state, saved.inputs
        self._checked = saved.state
        self._stepper.work.reset_to(saved.work)
        self._stepper.recall(saved.memory)
