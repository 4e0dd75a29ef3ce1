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

from cosim.controllers.frame import EXHALING, INHALING, Controller, Frame, output, parameter


class Cpap(Controller):
    """Continuous positive airway pressure for a patient who breathes."""

    description = "Continuous positive airway pressure, with the patient's effort"

    delta_p = output(0.0, "cmH2O", "pressure across the wall: airway's and muscles'")
    respiratory_pressure = output(0.0, "cmH2O", "airway pressure")
    muscle_pressure = output(0.0, "cmH2O", "pressure that the patient's muscles make")
    phase = output(INHALING, None, "1 while the patient makes an effort, 0 otherwise")
    pressure = parameter(8.0, "cmH2O", "airway pressure after the ramp", at_least=0.0)
    ramp_time = parameter(2.0, "s", "time in which it is built up", at_least=0.0)
    effort = parameter(5.0, "cmH2O", "peak of the patient's effort", at_least=0.0)
    effort_time = parameter(1.5, "s", "length of the patient's effort", at_least=1e-6)
    rate = parameter(15.0, "1/min", "the patient's efforts a minute", at_least=1e-6)
    frame = parameter(1 / 30, "s", "time between two actions", at_least=1e-6)

    def exit_initialization_mode(self) -> None:
        period = 60.0 / self.rate
        self.require(
            self.effort_time < period, "effort_time", f"less than the breath's {period:.4g} s"
        )

    def act(self, frame: Frame) -> None:
        risen = (frame.time + frame.length) / max(self.ramp_time, frame.length)
        self.respiratory_pressure = self.pressure * min(risen, 1.0)
        into_effort = frame.time % (60.0 / self.rate) / self.effort_time
        self.phase = INHALING if into_effort < 1.0 else EXHALING
        self.muscle_pressure = self.effort * math.sin(math.pi * min(into_effort, 1.0))
        self.delta_p = self.respiratory_pressure + self.muscle_pressure
