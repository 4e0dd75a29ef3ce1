"""The variables of a result dataset, with their units."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Final

from cosim import Causality, Participant, Port, RecordedVariable, SoftBodyParticipant
from scenarios.running.assemble import ADDING

_BODY: Final = [
    RecordedVariable("volume", ("body.volume",), "L", "enclosed volume"),
    RecordedVariable(
        "bounding_box_volume", ("body.bounding_box_volume",), "L", "bounding box volume"
    ),
    RecordedVariable(
        "bounding_box_min",
        tuple(f"body.bounding_box_min_{axis}" for axis in "xyz"),
        "m",
        "lowest corner of the bounding box",
    ),
    RecordedVariable(
        "bounding_box_max",
        tuple(f"body.bounding_box_max_{axis}" for axis in "xyz"),
        "m",
        "highest corner of the bounding box",
    ),
    RecordedVariable("pressure", ("body.pressure",), "cmH2O", "driving pressure across the wall"),
    RecordedVariable(
        "alveolar_pressure",
        ("body.alveolar_pressure",),
        "cmH2O",
        "pressure that the tissue balances",
    ),
    RecordedVariable("flow", ("body.flow",), "L/s", "flow into the body"),
]

_RESERVED: Final = (
    *("time", "axis", "snapshot", "snapshot_time", "position", "triangles", "point", "triangle"),
    *("corner", "clearance", "obstacle_points", "obstacle_triangles", "obstacle_point"),
    "obstacle_triangle",
)
"""Names of coordinates, and of what snapshots add."""

_CONTROLLER: Final[dict[str, tuple[str | None, str, Mapping[str, object]]]] = {
    "delta_p": ("cmH2O", "pressure difference across the wall from the controller", {}),
    "n": ("1", "number proportional to the molecules inside", {}),
    "respiratory_pressure": ("cmH2O", "respiratory pressure", {}),
    "target_volume": ("L", "volume that the controller aims at", {}),
    "phase": (
        "1",
        "phase of the breath",
        {"flag_values": [0, 1], "flag_meanings": "exhalation inhalation"},
    ),
}


def variables_of(
    bodies: Sequence[SoftBodyParticipant], controller: Participant | None
) -> list[RecordedVariable]:
    """Variables of a run: the body's, those of the controller that have a name here, its others.

    With several bodies, what adds up is there under its own name, and each body's variables begin
    with its name: `left_volume`, `right_volume`, and `volume` for both.
    """
    variables = _of_body(bodies[0]) if len(bodies) == 1 else _of_bodies(bodies)
    if controller is None:
        return variables
    taken = {*_RESERVED, *(variable.name for variable in variables)}
    taken |= {f"{body.name}_{name}" for body in bodies for name in _RESERVED}
    for port in controller.ports.values():
        if port.causality is Causality.OUTPUT:
            variables.append(_controller_variable(controller.name, port, taken))
            taken.add(variables[-1].name)
    return variables


def _of_bodies(bodies: Sequence[SoftBodyParticipant]) -> list[RecordedVariable]:
    together = [
        replace(
            variable,
            sources=tuple(f"{body.name}.{variable.name}" for body in bodies),
            long_name=f"{variable.long_name}, all bodies",
            added=True,
        )
        for variable in _BODY
        if variable.name in ADDING
    ]
    each = [
        replace(
            variable,
            name=f"{body.name}_{variable.name}",
            sources=tuple(source.replace("body", body.name, 1) for source in variable.sources),
            long_name=f"{variable.long_name}, {body.name}",
        )
        for body in bodies
        for variable in _BODY
    ]
    return [*together, *each]


def _of_body(body: SoftBodyParticipant) -> list[RecordedVariable]:
    variables = [*_BODY]
    if "clearance" in body.ports:
        long_name = body.ports["clearance"].description
        variables.append(RecordedVariable("clearance", ("body.clearance",), "m", long_name))
    variables += [
        RecordedVariable(
            f"{name}_position",
            tuple(f"body.{name}_{axis}" for axis in "xyz"),
            "m",
            f"centre of mass of {name}",
        )
        for name in body.moving
    ]
    return variables


def _controller_variable(owner: str, port: Port, taken: Collection[str]) -> RecordedVariable:
    """RecordedVariable of a controller's output; a name that is taken is changed."""
    source = (f"{owner}.{port.name}",)
    if port.name in _CONTROLLER and port.name not in taken:
        units, long_name, attributes = _CONTROLLER[port.name]
        return RecordedVariable(port.name, source, units, long_name, attributes)
    name = port.name.replace("/", "_")
    while name in taken:
        name = f"controller_{name}"
    return RecordedVariable(name, source, None, port.description or port.name)
