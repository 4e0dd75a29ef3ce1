"""A soft body as a participant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from typing import Any, Final

from cosim.body_bytes import deserialize, serialize
from cosim.participant import Causality, Port
from cosim.units import unit
from softbody_core import Inputs, Observation, SoftBody

_CORNERS: Final = [f"bounding_box_{end}_{axis}" for end in ("min", "max") for axis in "xyz"]
_PORTS: Final = [
    ("delta_p", "Pa", Causality.INPUT, "pressure difference across the wall, outward"),
    ("n", "1", Causality.INPUT, "number proportional to the molecules inside"),
    ("volume", "m3", Causality.OUTPUT, "enclosed volume"),
    ("bounding_box_volume", "m3", Causality.OUTPUT, "volume of the axis-aligned bounding box"),
    *(
        (f"bounding_box_{end}_{axis}", "m", Causality.OUTPUT, f"{word} {axis} of the bounding box")
        for end, word in (("min", "lowest"), ("max", "highest"))
        for axis in "xyz"
    ),
    ("pressure", "Pa", Causality.OUTPUT, "pressure that drives the wall outward"),
    ("alveolar_pressure", "Pa", Causality.OUTPUT, "pressure less the airway's share"),
    ("flow", "m3/s", Causality.OUTPUT, "flow into the body"),
]


@cache
def body_ports() -> Mapping[str, Port]:
    """Ports of every soft body, by name."""
    return {
        name: Port(name, unit(symbol), causality, description, optional=True)
        for name, symbol, causality, description in _PORTS
    }


@cache
def obstacle_ports(names: tuple[str, ...]) -> Mapping[str, Port]:
    """Ports of a body among obstacles: how near they are, and where those that move are."""
    lengths = [("clearance", "lower bound of the distance between the body's points and obstacles")]
    lengths += [
        (f"{name}_{axis}", f"{axis} of the centre of mass of {name}")
        for name in names
        for axis in "xyz"
    ]
    return {
        name: Port(name, unit("m"), Causality.OUTPUT, description, optional=True)
        for name, description in lengths
    }


class SoftBodyParticipant:
    """Offers a `SoftBody`'s inputs and what can be observed of it as ports, in SI units.

    An input that is not connected stays as it was given. Going back to a state is exact to the bit.

    Parameters
    ----------
    body : SoftBody
        The body; it moves as the co-simulation does.
    name : str
        Name of the participant.
    inputs : Inputs, optional
        What the body's inputs are until a connection says otherwise; 0 by default.
    """

    can_get_and_set_state = True
    can_serialize_state = True
    varies_step = True

    def __init__(self, body: SoftBody, name: str = "body", inputs: Inputs | None = None) -> None:
        self.name = name
        self.ports = body_ports()
        self.body = body
        obstacles = body.model.obstacles
        self.moving = tuple(obstacle.name for obstacle in obstacles if obstacle.moves)
        if obstacles:
            self.ports = {**self.ports, **obstacle_ports(self.moving)}
        self._inputs = asdict(inputs if inputs is not None else Inputs())
        self._outputs = self._values(body.observe())

    def initialize(self, time: float) -> None:
        """Nothing to do: a body stands where it stands."""

    def begin(self) -> None:
        """Nothing to do."""

    def write(self, values: Mapping[str, float]) -> None:
        """Set the inputs for the next step."""
        self._inputs.update(values)

    def step(self, time: float, step: float) -> None:
        """Move the body."""
        self._outputs = self._values(self.body.step(step, **self._inputs))

    def read(self) -> Mapping[str, float]:
        """Return what is observed of the body."""
        return self._outputs

    def get_state(self) -> object:
        """Body, inputs and outputs as they are now."""
        return self.body.get_state(), dict(self._inputs), self._outputs

    def set_state(self, state: Any) -> None:
        """Go back to what `get_state` gave."""
        body, inputs, outputs = state
        self.body.set_state(body)
        self._inputs, self._outputs = dict(inputs), outputs

    def free_state(self, state: Any) -> None:
        """Nothing to do: it is memory of Python's."""

    def serialize(self) -> bytes:
        """Write the state down."""
        return serialize(self.get_state())

    def deserialize(self, data: bytes) -> None:
        """Go to what `serialize` gave, in this body or its twin.

        Raises
        ------
        ParameterError
            If the data are damaged or those of a body with another number of points.
        """
        self.set_state(deserialize(data))

    def close(self) -> None:
        """Nothing to do."""

    def _values(self, observation: Observation) -> dict[str, float]:
        outputs = _outputs(observation)
        if self.body.model.obstacles:
            outputs["clearance"] = observation.clearance
        if self.moving:
            for law, obstacle in zip(self.body.model.obstacles, observation.obstacles, strict=True):
                if law.moves:
                    places = zip("xyz", obstacle.position.tolist(), strict=True)
                    outputs.update((f"{law.name}_{axis}", place) for axis, place in places)
        return outputs


def _outputs(observation: Observation) -> dict[str, float]:
    return {
        "volume": observation.volume,
        "bounding_box_volume": observation.bounding_box_volume,
        "pressure": observation.pressure,
        "alveolar_pressure": observation.alveolar_pressure,
        "flow": observation.flow,
        **dict(zip(_CORNERS, observation.bounding_box.ravel().tolist(), strict=True)),
    }
