"""Volume-controlled ventilation: constant flow, an inspiratory pause, and a passive exhalation.

While inhaling, the volume should follow V*(t) = V0 + V_T min(t / (Ti − pause), 1), V0 being the
volume at the start of the breath. A body takes a pressure, so the controller finds the one that
gives this volume. It acts at the start of each frame of length h and holds its output in between:

    p_k = p_(k−1) + R̂ (Q*_k − Q_(k−1)),   Q*_k = (V*_(k+1) − V*_k)/h + (V*_k − V_k)/(2h)

with Q_(k−1) = (V_k − V_(k−1))/h, the mean flow of the last frame: integral control of flow in
velocity form (Åström & Hägglund, Advanced PID Control, 2006), which needs no compliance and does
not wind up at the limit of pressure. By the equation of motion p = R Q + (V − V_rest)/C it is
stable for an assumed resistance R̂ below 1.6 R. While exhaling, p is PEEP.

A lung of resistance R and compliance C then shows a peak pressure of PEEP + R Q + V_T/C, and
PEEP + V_T/C in the pause (Chatburn, Respir Care 2007;52:301).
"""

from __future__ import annotations

from typing import Final

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

CLOSING: Final = 2.0
"""Frames in which a missing volume is made up."""


class VolumeControl(Controller):
    """Volume-controlled ventilation."""

    description = "Volume-controlled ventilation: constant flow and an inspiratory pause"

    volume = input_(0.0, "L", "enclosed volume of the lung")
    delta_p = output(0.0, "cmH2O", "pressure difference across the wall")
    respiratory_pressure = output(0.0, "cmH2O", "airway pressure, the same as delta_p")
    target_volume = output(0.0, "L", "volume wanted at the end of the frame")
    phase = output(INHALING, None, "1 inhaling, the pause included; 0 exhaling")
    breaths = local(0, None, "breaths begun")
    start_volume = local(0.0, "L", "volume at the start of the breath")
    last_volume = local(0.0, "L", "volume at the start of the last frame")
    tidal_volume = parameter(0.5, "L", "volume given with each breath", at_least=0.0)
    rate = parameter(15.0, "1/min", "breaths a minute", at_least=1e-6)
    inspiratory_time = parameter(
        1.5, "s", "length of the inspiratory phase with its pause", at_least=1e-6
    )
    pause = parameter(0.3, "s", "time without flow at its end", at_least=0.0)
    peep = parameter(5.0, "cmH2O", "positive end-expiratory pressure", at_least=0.0)
    resistance = parameter(
        5.0, "cmH2O.s/L", "airway resistance that the controller assumes", at_least=1e-6
    )
    pressure_limit = parameter(100.0, "cmH2O", "largest airway pressure", at_least=0.0)
    frame = parameter(1 / 30, "s", "time between two actions", at_least=1e-6)

    def exit_initialization_mode(self) -> None:
        period = 60.0 / self.rate
        self.require(
            self.pause < self.inspiratory_time < period,
            "inspiratory_time",
            f"more than the pause of {self.value_of('pause')} and less than the breath's "
            f"{period:.4g} s",
        )

    def act(self, frame: Frame) -> None:
        breath, into_breath = divmod(frame.time, 60.0 / self.rate)
        if breath >= self.breaths:
            self.last_volume = self.last_volume if self.breaths else self.volume
            self.start_volume, self.breaths = self.volume, int(breath) + 1
        inhaling = into_breath < self.inspiratory_time
        self.phase = INHALING if inhaling else EXHALING
        due = self._wanted(into_breath)
        self.target_volume = self._wanted(into_breath + frame.length)
        if inhaling:
            wanted = (self.target_volume - due) + (due - self.volume) / CLOSING
            missing = wanted - (self.volume - self.last_volume)
            pressure = self.respiratory_pressure + self.resistance * missing / frame.length
            self.respiratory_pressure = min(max(pressure, 0.0), self.pressure_limit)
        else:
            self.respiratory_pressure = self.peep
        self.delta_p = self.respiratory_pressure
        self.last_volume = self.volume

    def _wanted(self, into_breath: float) -> float:
        """Volume that the lung should have."""
        share: float = min(into_breath / (self.inspiratory_time - self.pause), 1.0)
        return self.start_volume + self.tidal_volume * share
