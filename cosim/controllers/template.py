"""A controller to start from: proportional control of volume.

It pushes in proportion to what is missing of a target volume, which it raises and lowers. It acts
at the start of each frame and holds its output in between, so that a run does not depend on the
communication step.
"""

from __future__ import annotations

from cosim.controllers.frame import (
    EXHALING,
    INHALING,
    Controller,
    Frame,
    input_,
    local,
    output,
    parameter,
)


class Template(Controller):
    """Proportional control of volume."""

    description = "Proportional control of volume"

    # Start value, unit, description. Inputs are what the body gives, by name; a unit that converts
    # will do. What has to be remembered from frame to frame is local. A start value without a
    # decimal point makes a whole number, which has no unit.
    volume = input_(0.0, "L", "enclosed volume")
    delta_p = output(0.0, "cmH2O", "pressure difference across the wall")
    phase = output(INHALING, None, "1 inhaling, 0 exhaling")
    breaths = local(0, None, "breaths begun")
    rest_volume = local(0.0, "L", "volume at the start")
    tidal_volume = parameter(0.5, "L", "how far the target is raised")
    gain = parameter(50.0, "cmH2O/L", "pressure for each litre that is missing", at_least=0.0)
    period = parameter(4.0, "s", "length of one breath", at_least=1e-6)
    frame = parameter(1 / 30, "s", "time between two actions", at_least=1e-6)

    def act(self, frame: Frame) -> None:
        breath, into_breath = divmod(frame.time, self.period)
        if self.breaths == 0:
            self.rest_volume = self.volume
        self.breaths = int(breath) + 1
        self.phase = INHALING if into_breath < self.period / 2 else EXHALING
        target = self.rest_volume + self.tidal_volume * self.phase
        self.delta_p = self.gain * (target - self.volume)
