"""Pressure-volume hysteresis: an inflation and a deflation limb, re-based at each reversal.

The respiratory pressure P rises and falls evenly, `frames` times a breath. The volume wanted lies
on a sigmoid between the asymptotes a and a + b (Venegas, Harris & Simon, J Appl Physiol 1998;84:
389), stretched so that each limb starts at the point (P_r, V_r) of the last reversal:

    inflation   V = a + b − (a + b − V_r) g(P)/g(P_r),   g(P) = 1 / (1 + e^((P − c_inflation)/d))
    deflation   V = a + (V_r − a) h(P)/h(P_r),           h(P) = 1 / (1 + e^(−(P − c_deflation)/d))

The first limb starts at the body's own volume. So there are no jumps, every limb stays between the
asymptotes, and the loops close upon one loop from breath to breath.

A body takes a pressure; the one that gives the volume wanted at the end of the frame is found as in
`volume_control.py`, with an assumed resistance.
"""

from __future__ import annotations

import math
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


class Hysteresis(Controller):
    """Pressure-volume controller with hysteresis."""

    description = "Pressure-volume hysteresis: two sigmoid limbs, re-based at each reversal"

    volume = input_(0.0, "L", "enclosed volume of the lung")
    delta_p = output(0.0, "cmH2O", "pressure difference across the wall")
    respiratory_pressure = output(0.0, "cmH2O", "P of the limbs")
    target_volume = output(0.0, "L", "volume of the limb at P, wanted at the end of the frame")
    phase = output(EXHALING, None, "1 inhaling, 0 exhaling")
    next_frame = local(0, None, "frames done")
    last_volume = local(0.0, "L", "volume at the start of the last frame")
    reversal_pressure = local(0.0, "cmH2O", "P of the last reversal")
    reversal_volume = local(0.0, "L", "volume of the last reversal")
    asymptote = parameter(2.4, "L", "a, which no deflation goes below", at_least=0.0)
    vital_capacity = parameter(3.5, "L", "b, between the asymptotes", at_least=1e-6)
    c_inflation = parameter(20.0, "cmH2O", "c of the inflation limb")
    c_deflation = parameter(10.0, "cmH2O", "c of the deflation limb")
    d = parameter(5.0, "cmH2O", "d of both limbs", at_least=1e-6)
    pressure_low = parameter(0.0, "cmH2O", "lowest P")
    pressure_high = parameter(30.0, "cmH2O", "highest P")
    period = parameter(4.0, "s", "length of one breath", at_least=1e-6)
    frames = parameter(120, None, "frames in one breath", at_least=2)
    resistance = parameter(
        5.0, "cmH2O.s/L", "airway resistance that the controller assumes", at_least=1e-6
    )
    pressure_limit = parameter(100.0, "cmH2O", "largest delta_p, either way", at_least=0.0)

    @property
    def frame_length(self) -> float:
        return self.period / self.frames

    def exit_initialization_mode(self) -> None:
        self.require(self.frames % 2 == 0, "frames", "an even number")
        self.require(
            self.pressure_low <= self.pressure_high,
            "pressure_low",
            f"at most pressure_high = {self.value_of('pressure_high')}",
        )

    def act(self, frame: Frame) -> None:
        if self.next_frame == 0:
            self.last_volume, self.respiratory_pressure = self.volume, self.pressure_low
            top = self.asymptote + self.vital_capacity
            self.target_volume = min(max(self.volume, self.asymptote), top)
        into_breath = frame.number % self.frames
        phase = INHALING if into_breath < self.frames // 2 else EXHALING
        if phase != self.phase:
            self.phase = phase
            self.reversal_pressure = self.respiratory_pressure
            self.reversal_volume = self.target_volume
        due = self.target_volume
        steps = into_breath + 1 if phase == INHALING else self.frames - into_breath - 1
        swing = self.pressure_high - self.pressure_low
        self.respiratory_pressure = self.pressure_low + swing * steps / (self.frames // 2)
        self.target_volume = self._limb(self.respiratory_pressure)
        wanted = (self.target_volume - due) + (due - self.volume) / CLOSING
        missing = wanted - (self.volume - self.last_volume)
        pressure = self.delta_p + self.resistance * missing / frame.length
        self.delta_p = min(max(pressure, -self.pressure_limit), self.pressure_limit)
        self.last_volume, self.next_frame = self.volume, frame.number + 1

    def _limb(self, pressure: float) -> float:
        """Volume on the limb that started at the last reversal."""
        if self.phase == INHALING:
            start, end = self.reversal_pressure - self.c_inflation, pressure - self.c_inflation
            top = self.asymptote + self.vital_capacity
            share = math.exp(_softplus(start / self.d) - _softplus(end / self.d))
            return top - (top - self.reversal_volume) * share
        start, end = self.c_deflation - self.reversal_pressure, self.c_deflation - pressure
        share = math.exp(_softplus(start / self.d) - _softplus(end / self.d))
        return self.asymptote + (self.reversal_volume - self.asymptote) * share


def _softplus(x: float) -> float:
    """Work out log(1 + e^x) without overflow; g and h are e^(−softplus)."""
    return max(x, 0.0) + math.log1p(math.exp(-abs(x)))
