"""A soft body as a participant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cosim.participant import Causality, Port
from cosim.units import unit
from softbody_core import Observation, SoftBody

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


class SoftBodyParticipant:
    """Offers a `SoftBody`'s inputs and what can be observed of it as ports, in SI units.

    An input that is not connected stays 0.

    Parameters
    ----------
    body : SoftBody
        The body; it moves as the co-simulation does.
    name : str
        Name of the participant.
    """

    def __init__(self, body: SoftBody, name: str = "body") -> None:
        self.name = name
        self.ports: Mapping[str, Port] = {
            port: Port(port, unit(symbol), causality, description, optional=True)
            for port, symbol, causality, description in _PORTS
        }
        self.body = body
        self._inputs = {"delta_p": 0.0, "n": 0.0}
        self._outputs = _outputs(body.observe())

    def initialize(self, time: float) -> None:
        """Nothing to do: a body stands where it stands."""

    def begin(self) -> None:
        """Nothing to do."""

    def write(self, values: Mapping[str, float]) -> None:
        """Set the inputs for the next step."""
        self._inputs.update(values)

    def step(self, time: float, step: float) -> None:
        """Move the body."""
        self._outputs = _outputs(self.body.step(step, **self._inputs))

    def read(self) -> Mapping[str, float]:
        """Return what is observed of the body."""
        return self._outputs

    def close(self) -> None:
        """Nothing to do."""


def _outputs(seen: Observation) -> dict[str, float]:
    return {
        "volume": seen.volume,
        "bounding_box_volume": seen.bounding_box_volume,
        "pressure": seen.pressure,
        "alveolar_pressure": seen.alveolar_pressure,
        "flow": seen.flow,
        **dict(zip(_CORNERS, seen.bounding_box.ravel().tolist(), strict=True)),
    }
