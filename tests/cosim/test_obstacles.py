"""Obstacles around a body, seen through its ports and its saved bytes."""

from __future__ import annotations

import numpy as np
import pytest

from cosim import SoftBodyParticipant
from softbody_core import Constraint, ParameterError, RigidBody, VolumeCap, WeightCourse
from tests.core.contacts import GAS, INERTIAL, slab, soft_ball, still


def hit(name: str = "symplectic-euler") -> SoftBodyParticipant:
    """A ball that hits a free plate, capped and with a weight that changes."""
    plate = RigidBody(slab(0.02, 0.1).moved((0, 0, -0.01)), "free", 0.05, gravity=0.0, name="plate")
    table = still(slab(0.02, 1.0).moved((0, 0, -0.2)), name="table")
    others: list[Constraint] = [VolumeCap(1.3e-4), WeightCourse("alpha", (0.0, 0.2), (1.0, 3.0))]
    body = soft_ball([plate, table], name, centre=(0.01, 0, 0.036), constraints=others)
    participant = SoftBodyParticipant(body)
    participant.write({"n": GAS})
    return participant


@pytest.mark.parametrize("name", INERTIAL)
def test_a_body_among_obstacles_goes_on_from_bytes_to_the_bit(name: str) -> None:
    first, twin = hit(name), hit(name)
    for k in range(12):
        first.step(k * 0.01, 0.01)
    twin.deserialize(first.serialize())
    assert twin.read() == first.read()
    for k in range(12, 20):
        first.step(k * 0.01, 0.01)
        twin.step(k * 0.01, 0.01)
        assert twin.read() == first.read()
    np.testing.assert_array_equal(first.body.positions, twin.body.positions)
    plate = first.body.state.obstacles[0]
    assert plate.velocity[2] < -0.01  # it was hit
    np.testing.assert_array_equal(plate.rotation, twin.body.state.obstacles[0].rotation)


def test_ports_tell_how_near_walls_are_and_where_moving_ones_are() -> None:
    body = hit()
    assert {"clearance", "plate_x", "plate_y", "plate_z"} <= set(body.ports)
    assert not any(port.startswith("table") for port in body.ports)
    body.step(0.0, 0.01)
    outputs = body.read()
    assert outputs["clearance"] > 0
    place = [outputs[f"plate_{axis}"] for axis in "xyz"]
    assert place == body.body.state.obstacles[0].position.tolist()


def test_without_obstacles_there_are_no_ports_of_theirs() -> None:
    body = SoftBodyParticipant(soft_ball([]))
    assert "clearance" not in body.ports


def test_bytes_of_a_body_without_obstacles_are_refused_by_name() -> None:
    alone, among = SoftBodyParticipant(soft_ball([])), hit()
    before = among.body.state
    with pytest.raises(ParameterError, match="obstacles"):
        among.deserialize(alone.serialize())
    assert among.body.state is before
    with pytest.raises(ParameterError, match="obstacles"):
        alone.deserialize(among.serialize())
