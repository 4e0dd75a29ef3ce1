"""A controller to start from: proportional control of volume.

It pushes in proportion to what is missing of a target volume, which it raises and lowers. It acts
at the start of each frame and holds its output in between, so that a run does not depend on the
communication step.
"""

from __future__ import annotations

import math
from typing import ClassVar, Final

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.default_experiment import DefaultExperiment

INHALING, EXHALING = 1, 0
INPUT, OUTPUT = Fmi2Causality.input, Fmi2Causality.output
STATE, PARAMETER = Fmi2Causality.local, Fmi2Causality.parameter
VARIABILITY: Final = {INPUT: Fmi2Variability.continuous, PARAMETER: Fmi2Variability.fixed}

# Name: causality, start value, unit, description. Inputs are what the body gives, by name; a unit
# that converts will do. What has to be remembered from step to step is STATE. A start value without
# a decimal point makes a whole number, which has no unit.
VARIABLES: Final = {
    "volume": (INPUT, 0.0, "L", "enclosed volume"),
    "delta_p": (OUTPUT, 0.0, "cmH2O", "pressure difference across the wall"),
    "phase": (OUTPUT, INHALING, None, "1 inhaling, 0 exhaling"),
    "breaths": (STATE, 0, None, "breaths begun"),
    "rest_volume": (STATE, 0.0, "L", "volume at the start"),
    "tidal_volume": (PARAMETER, 0.5, "L", "how far the target is raised"),
    "gain": (PARAMETER, 50.0, "cmH2O/L", "pressure for each litre that is missing"),
    "period": (PARAMETER, 4.0, "s", "length of one breath"),
    "frame": (PARAMETER, 1 / 30, "s", "time between two actions"),
}


class Template(Fmi2Slave):
    """Proportional control of volume."""

    description = "Proportional control of volume"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True  # all that it remembers is in VARIABLES, so it can be saved and restored
    units: ClassVar = {name: unit for name, (_, _, unit, _) in VARIABLES.items() if unit}
    bounds: ClassVar = {
        "gain": (0.0, None),  # smallest and largest value that is accepted; None for no bound
        "period": (1e-6, None),
        "frame": (1e-6, None),
    }

    breaths: int

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        for name, (causality, start, _, said) in VARIABLES.items():
            setattr(self, name, start)
            kind = Integer if isinstance(start, int) else Real
            variability = VARIABILITY.get(causality, Fmi2Variability.discrete)
            self.register_variable(
                kind(name, causality=causality, variability=variability, description=said)
            )

    def do_step(self, current_time: float, step_size: float) -> bool:
        # Frames that begin in this step; the slack keeps them on the communication points that
        # they fall on.
        ends = (current_time, current_time + step_size)
        for frame in range(*(math.ceil(end / self.frame - 1e-6) for end in ends)):
            self._act((frame + 1e-6) * self.frame)
        return True

    def _act(self, time: float) -> None:
        """Set the outputs for one frame."""
        breath, into_breath = divmod(time, self.period)
        if self.breaths == 0:
            self.rest_volume = self.volume
        self.breaths = int(breath) + 1
        self.phase = INHALING if into_breath < self.period / 2 else EXHALING
        target = self.rest_volume + self.tidal_volume * self.phase
        self.delta_p = self.gain * (target - self.volume)
