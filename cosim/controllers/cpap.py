"""Continuous positive airway pressure: one pressure all the time, while the patient breathes.

The airway pressure rises evenly to `pressure` within the ramp and stays there. The patient's effort
is a half sine of length Te in each breath, and the wall feels the sum of both. It acts at the start
of each frame.

A lung of resistance R and compliance C answers an effort A sin(ωt), ω = π/Te, with
V = C A (sin ωt − ωτ cos ωt + ωτ e^(−t/τ)) / (1 + ω²τ²), τ = R C, above C · pressure: the equation
of motion (Rodarte & Rehder, Handbook of Physiology, 1986), solved.
"""

from __future__ import annotations

import math
from typing import ClassVar, Final

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.default_experiment import DefaultExperiment

INHALING, EXHALING = 1, 0
OUTPUT, PARAMETER = Fmi2Causality.output, Fmi2Causality.parameter

VARIABLES: Final = {
    "delta_p": (OUTPUT, 0.0, "cmH2O", "pressure across the wall: airway's and muscles'"),
    "respiratory_pressure": (OUTPUT, 0.0, "cmH2O", "airway pressure"),
    "muscle_pressure": (OUTPUT, 0.0, "cmH2O", "pressure that the patient's muscles make"),
    "phase": (OUTPUT, INHALING, None, "1 while the patient makes an effort, 0 otherwise"),
    "pressure": (PARAMETER, 8.0, "cmH2O", "airway pressure after the ramp"),
    "ramp_time": (PARAMETER, 2.0, "s", "time in which it is built up"),
    "effort": (PARAMETER, 5.0, "cmH2O", "peak of the patient's effort"),
    "effort_time": (PARAMETER, 1.5, "s", "length of the patient's effort"),
    "rate": (PARAMETER, 15.0, "1/min", "the patient's efforts a minute"),
    "frame": (PARAMETER, 1 / 30, "s", "time between two actions"),
}
"""Causality, start, unit and description."""


class Cpap(Fmi2Slave):
    """Continuous positive airway pressure for a patient who breathes."""

    description = "Continuous positive airway pressure, with the patient's effort"
    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True
    units: ClassVar = {name: unit for name, (_, _, unit, _) in VARIABLES.items() if unit}
    bounds: ClassVar = {
        **dict.fromkeys(["pressure", "ramp_time", "effort"], (0.0, None)),
        **dict.fromkeys(["effort_time", "rate", "frame"], (1e-6, None)),
    }

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        for name, (causality, start, _, said) in VARIABLES.items():
            setattr(self, name, start)
            kind = Integer if isinstance(start, int) else Real
            fixed = causality is PARAMETER
            variability = Fmi2Variability.fixed if fixed else Fmi2Variability.discrete
            self.register_variable(
                kind(name, causality=causality, variability=variability, description=said)
            )

    def exit_initialization_mode(self) -> None:
        if self.effort_time >= 60.0 / self.rate:
            raise ValueError(
                f"effort_time = {self.effort_time} s: expected less than the breath's "
                f"{60.0 / self.rate:.4g} s"
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
        risen = (time + self.frame) / max(self.ramp_time, self.frame)
        self.respiratory_pressure = self.pressure * min(risen, 1.0)
        into_effort = time % (60.0 / self.rate) / self.effort_time
        self.phase = INHALING if into_effort < 1.0 else EXHALING
        self.muscle_pressure = self.effort * math.sin(math.pi * min(into_effort, 1.0))
        self.delta_p = self.respiratory_pressure + self.muscle_pressure
