"""The same ball in this project, in MuJoCo and in pybullet, each behind one small interface."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any, Protocol

import numpy as np
from measure import calibrating_ball
from peer_truth import (
    DAMPING,
    MASS,
    SHELL_POISSON,
    SHELL_YOUNG,
    STIFFNESS,
    kick,
    volume_gradient_of,
    volume_of,
)

from softbody_core import (
    InternalPressure,
    MassSpring,
    SoftBody,
    SoftBodyModel,
)
from softbody_core.integrators import Integrator
from softbody_core.state import State


class Ball(Protocol):
    """A ball at rest. `seconds` and `steps` count what its simulator needed, and nothing else."""

    seconds: float
    steps: int

    def kick(self) -> None:
        """Start breathing."""

    def advance(self, span: float, pressure: float) -> float:
        """Move on by `span`, s, under a pressure, Pa, and return the volume, m³."""
        ...


class Ours:
    """Our own ball. The pressure is the body's input, and the volume what it gives."""

    def __init__(self, scheme: Integrator) -> None:
        self.seconds, self.steps = 0.0, 0
        laws = [MassSpring(STIFFNESS, DAMPING), InternalPressure(0.0)]
        self._body = SoftBody(SoftBodyModel(calibrating_ball(), MASS, laws), scheme)

    def kick(self) -> None:
        saved = self._body.get_state()
        moving = State(0.0, saved.state.positions, np.ascontiguousarray(kick().T))
        self._body.set_state(replace(saved, state=moving))

    def advance(self, span: float, pressure: float) -> float:
        started = process_time()
        seen = self._body.step(span, delta_p=pressure)
        self.seconds += process_time() - started
        self.steps = self._body.counters.steps
        return seen.volume


class MuJoCo:
    """A flex of springs (dim 1) or of triangles (dim 2). Pressure is computed outside, untimed."""

    def __init__(self, step: float, *, triangles: bool) -> None:
        import mujoco

        mujoco.set_mju_user_warning(lambda _: None)  # else it writes a log file where it stands
        mesh = calibrating_ball()
        elements = mesh.triangles if triangles else mesh.edges
        law = (
            f'<elasticity young="{SHELL_YOUNG / 1e-3}" poisson="{SHELL_POISSON}" thickness="1e-3" '
            'elastic2d="stretch"/>'
            if triangles
            else f'<edge stiffness="{STIFFNESS}" damping="{DAMPING}"/>'
        )
        scheme = "discrete" if triangles else "Euler"
        xml = f"""
        <mujoco>
          <option timestep="{step}" gravity="0 0 0" integrator="{scheme}">
            <flag contact="disable"/>
          </option>
          <size memory="400M"/>
          <worldbody>
            <flexcomp name="ball" type="direct" dim="{2 if triangles else 1}" mass="{MASS}"
                      radius="1e-4" point="{_text(mesh.points)}" element="{_text(elements)}">
              <contact selfcollide="none" contype="0" conaffinity="0"/>
              {law}
            </flexcomp>
          </worldbody>
        </mujoco>"""
        self._advance = mujoco.mj_step
        self._model: Any = mujoco.MjModel.from_xml_string(xml)
        self._data: Any = mujoco.MjData(self._model)
        self._rest = mesh.points
        self.step, self.seconds, self.steps = step, 0.0, 0

    def kick(self) -> None:
        self._data.qvel[:] = kick().ravel()

    def advance(self, span: float, pressure: float) -> float:
        for _ in range(round(span / self.step)):
            if pressure:
                gradient = volume_gradient_of(self._points())
                self._data.qfrc_applied[:] = pressure * gradient.ravel()
            started = process_time()
            self._advance(self._model, self._data)
            self.seconds += process_time() - started
            self.steps += 1
        if sum(warning.number for warning in self._data.warning):
            raise ArithmeticError("MuJoCo warned and started again from rest")
        return volume_of(self._points())

    def _points(self) -> np.ndarray:
        return self._rest + self._data.qpos.reshape(-1, 3)


class PyBullet:
    """A deformable of springs. No pressure can be had: see `forces_reach_it`."""

    def __init__(self, step: float) -> None:
        import pybullet

        if not pybullet.isConnected():
            pybullet.connect(pybullet.DIRECT)
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD)
        pybullet.setGravity(0, 0, 0)
        pybullet.setTimeStep(step)
        mesh = calibrating_ball()
        with TemporaryDirectory() as folder:
            file = Path(folder) / "ball.obj"
            rows = [f"v {_text(point)}" for point in mesh.points]
            rows += [f"f {_text(triangle + 1)}" for triangle in mesh.triangles]
            file.write_text("\n".join(rows))
            self._id = pybullet.loadSoftBody(
                str(file),
                mass=MASS,
                scale=1.0,
                collisionMargin=1e-4,
                useMassSpring=1,
                springElasticStiffness=STIFFNESS,
                springDampingStiffness=DAMPING,
                springDampingAllDirections=1,
            )
        self._bullet: Any = pybullet
        self.step, self.seconds, self.steps = step, 0.0, 0

    def kick(self) -> None:
        # Velocities cannot be set. Points can; the rest shape follows them, but only after the
        # first step, in which the springs pull.
        self._bullet.resetMeshData(self._id, (1.05 * calibrating_ball().points).tolist())

    def forces_reach_it(self) -> bool:
        """Whether an external force on a point moves anything."""
        before = self._points()
        self._bullet.applyExternalForce(self._id, 0, [0, 0, 1], [0, 0, 0], self._bullet.WORLD_FRAME)
        self.advance(self.step, 0.0)
        return bool(np.abs(self._points() - before).max() > 1e-12)

    def advance(self, span: float, pressure: float) -> float:
        for _ in range(round(span / self.step)):
            started = process_time()
            self._bullet.stepSimulation()
            self.seconds += process_time() - started
            self.steps += 1
        return volume_of(self._points())

    def _points(self) -> np.ndarray:
        flags = self._bullet.MESH_DATA_SIMULATION_MESH
        return np.array(self._bullet.getMeshData(self._id, -1, flags=flags)[1])


def _text(values: np.ndarray) -> str:
    return " ".join(f"{value:.9g}" for value in values.ravel())
