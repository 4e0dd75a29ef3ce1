from __future__ import annotations

import pytest

from cosim import Causality, Connection, SoftBodyParticipant, WiringError, cosimulate
from softbody_core import (
    AirwayResistance,
    InternalPressure,
    MassSpring,
    SoftBody,
    SoftBodyModel,
    SurfaceMesh,
)
from tests.cosim.helpers import Source


@pytest.fixture
def body(potato: SurfaceMesh) -> SoftBody:
    laws = [
        MassSpring(stiffness=375.0, damping=0.1),
        InternalPressure(gas_energy=2e-3),
        AirwayResistance(resistance=1e6),
    ]
    return SoftBody(SoftBodyModel(potato, mass=1.0, forces=laws))


def test_ports_are_in_si_units(body: SoftBody) -> None:
    ports = SoftBodyParticipant(body).ports
    assert {p.unit.symbol for p in ports.values() if p.unit} == {"Pa", "1", "m3", "m3/s", "m"}
    for port in ports.values():
        assert port.unit is not None
        assert (port.unit.factor, port.unit.offset) == (1.0, 0.0)


def test_every_output_port_has_a_value_and_no_value_lacks_a_port(body: SoftBody) -> None:
    participant = SoftBodyParticipant(body)
    outputs = {n for n, p in participant.ports.items() if p.causality is Causality.OUTPUT}
    assert set(participant.read()) == outputs


def test_step_is_the_step_of_the_body(body: SoftBody) -> None:
    twin = SoftBody(body.model)
    participant = SoftBodyParticipant(body)
    participant.initialize(0.0)
    for i, delta_p in enumerate([300.0, -100.0]):
        participant.write({"delta_p": delta_p, "n": 5e4})
        participant.step(i * 0.01, 0.01)
        observation = twin.step(0.01, delta_p=delta_p, n=5e4)
    values = participant.read()
    for name in ("volume", "bounding_box_volume", "pressure", "alveolar_pressure", "flow"):
        assert values[name] == getattr(observation, name)
    for i, end in enumerate(["min", "max"]):
        corner = [values[f"bounding_box_{end}_{axis}"] for axis in "xyz"]
        assert corner == observation.bounding_box[i].tolist()
    assert values["pressure"] != values["alveolar_pressure"]  # so that the two are told apart


def test_open_inputs_stay_zero(body: SoftBody) -> None:
    twin = SoftBody(body.model)
    points = list(cosimulate([SoftBodyParticipant(body)], [], step=0.01, steps=2))
    twin.step(0.01)
    assert points[-1].outputs["body"]["volume"] == twin.step(0.01).volume


def test_one_input_alone_may_be_connected_and_is_converted(body: SoftBody) -> None:
    twin = SoftBody(body.model)
    participants = [Source(3.0, "cmH2O"), SoftBodyParticipant(body)]
    wires = [Connection("source.y", "body.delta_p")]
    points = list(cosimulate(participants, wires, step=0.01, steps=1))
    assert points[1].outputs["body"]["volume"] == twin.step(0.01, delta_p=3.0 * 98.0665).volume


def test_volume_cannot_drive_the_pressure(body: SoftBody) -> None:
    with pytest.raises(WiringError, match=r"source\.y → body\.delta_p"):
        next(
            cosimulate(
                [Source(3.0, "L"), SoftBodyParticipant(body)],
                [Connection("source.y", "body.delta_p")],
                step=0.01,
                steps=1,
            )
        )
