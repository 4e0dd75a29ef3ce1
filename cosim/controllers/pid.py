"""PID control: makes the volume, or the alveolar pressure, follow a waveform.

With the error e = r − y, and K, Ti, Td in the standard form,

    u = K e + I − K Td dy_f/dt,   dI/dt = (K e + sat(u) − u)/Ti

The derivative acts on what is measured, filtered with Td/10. The last term keeps the integral from
winding up while u is at its limits (back-calculation with the tracking time Ti). It acts at the
start of each frame, by backward differences (Åström & Murray, Feedback Systems, 2008, section
10.5).

On a lung of resistance R and compliance C, whose volume follows the pressure with the lag τ = R C,
Ti = τ and Td = 0 make the volume follow the waveform with the lag R/K. It is stable as long as that
is well above a frame.
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

FILTER: Final = 10.0
"""Derivative time over the time constant of its filter."""


class Pid(Controller):
    """PID control of volume or pressure."""

    description = "PID control: volume or alveolar pressure follows a waveform"

    volume = input_(0.0, "L", "enclosed volume of the lung")
    alveolar_pressure = input_(0.0, "cmH2O", "pressure that the tissue balances")
    delta_p = output(0.0, "cmH2O", "pressure difference across the wall, u")
    target_volume = output(0.0, "L", "r for the volume; the volume itself if left alone")
    target_pressure = output(0.0, "cmH2O", "r for the pressure; the pressure if left alone")
    phase = output(INHALING, None, "1 in the first half of the period, 0 in the second")
    frames = local(0, None, "frames done")
    last_measured = local(0.0, "cmH2O", "K y of the last frame")
    integral = local(0.0, "cmH2O", "I")
    derivative = local(0.0, "cmH2O", "the derivative's part of u")
    quantity = parameter("volume", None, "what follows the waveform: volume or pressure")
    waveform = parameter("sine", None, "sine or square")
    period = parameter(4.0, "s", "period of the waveform", at_least=1e-6)
    volume_low = parameter(2.5, "L", "lowest volume of the waveform")
    volume_high = parameter(3.0, "L", "highest volume of the waveform")
    volume_gain = parameter(50.0, "cmH2O/L", "K for the volume", at_least=0.0)
    pressure_low = parameter(0.0, "cmH2O", "lowest pressure of the waveform")
    pressure_high = parameter(10.0, "cmH2O", "highest pressure of the waveform")
    pressure_gain = parameter(4.0, "1", "K for the pressure", at_least=0.0)
    integral_time = parameter(1.0, "s", "Ti", at_least=1e-6)
    derivative_time = parameter(0.0, "s", "Td", at_least=0.0)
    delta_p_low = parameter(-50.0, "cmH2O", "lower limit of u")
    delta_p_high = parameter(100.0, "cmH2O", "upper limit of u")
    frame = parameter(1 / 30, "s", "time between two actions", at_least=1e-6)

    def exit_initialization_mode(self) -> None:
        quantity, waveform = self.quantity, self.waveform
        self.require(quantity in ("volume", "pressure"), "quantity", "'volume' or 'pressure'")
        self.require(waveform in ("sine", "square"), "waveform", "'sine' or 'square'")
        self.require(
            self.integral_time >= self.frame,
            "integral_time",
            f"at least one frame, {self.frame:.4g} s",
        )
        for low in ("volume_low", "pressure_low", "delta_p_low"):
            high = low.replace("low", "high")
            fits = getattr(self, low) <= getattr(self, high)
            self.require(fits, low, f"at most {high} = {self.value_of(high)}")

    def act(self, frame: Frame) -> None:
        share = self._share(frame.time)
        self.target_volume, self.target_pressure = self.volume, self.alveolar_pressure
        if self.quantity == "volume":
            self.target_volume = self.volume_low + (self.volume_high - self.volume_low) * share
            gain, target, measured = self.volume_gain, self.target_volume, self.volume
        else:
            swing = self.pressure_high - self.pressure_low
            self.target_pressure = self.pressure_low + swing * share
            gain, target = self.pressure_gain, self.target_pressure
            measured = self.alveolar_pressure
        proportional = gain * (target - measured)
        change = gain * measured - self.last_measured if self.frames else 0.0
        self.last_measured, self.frames = gain * measured, self.frames + 1
        lag = self.derivative_time / FILTER
        slope = self.derivative_time * change
        self.derivative = (lag * self.derivative - slope) / (lag + frame.length)
        wanted = proportional + self.integral + self.derivative
        self.delta_p = min(max(wanted, self.delta_p_low), self.delta_p_high)
        excess = wanted - self.delta_p
        self.integral += frame.length / self.integral_time * (proportional - excess)

    def _share(self, time: float) -> float:
        """Where the waveform stands between low and high, and the phase that goes with it."""
        position = time % self.period / self.period
        self.phase = INHALING if position < 0.5 else EXHALING
        if self.waveform == "square":
            return float(self.phase)
        return (1.0 - math.cos(2 * math.pi * position)) / 2
