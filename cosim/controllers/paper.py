"""The respiratory pressure-volume controller of Mesit & Guha (2011), section 5.

A breath is a number of frames, and the controller acts at the start of each:

    inhaling    P ← P + ΔP,   N by how far the volume falls short of f(P)
    exhaling    P ← P − ΔP,   N = n_deflation: the gas is let out

    f(P) = a + b / (1 + e^(−(P − c)/d)),   c_inflation and c_deflation in place of c
"""

from __future__ import annotations

import math

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


class PaperController(Controller):
    """Sigmoid P-V controller of Mesit & Guha (2011)."""

    description = "Sigmoid pressure-volume controller of Mesit & Guha (2011), section 5"

    volume = input_(0.0, "L", "enclosed volume of the lung")
    bounding_box_volume = input_(0.0, "L", "volume of the lung's bounding box")
    delta_p = output(
        0.0, "cmH2O", "pressure difference across the wall: +ΔP inhaling, −ΔP exhaling"
    )
    n = output(0.0, "1", "number proportional to the molecules inside")
    respiratory_pressure = output(0.0, "cmH2O", "P of the sigmoid")
    target_volume = output(0.0, "L", "f(P), the volume that the controller aims at")
    phase = output(INHALING, None, "1 inhaling, 0 exhaling")
    next_frame = local(0, None, "frames done")
    rest_volume = parameter(
        2.5, "L", "volume at P = 0 on inflation, from which a follows", at_least=0.0
    )
    vital_capacity = parameter(3.5, "L", "b of the sigmoid", at_least=1e-6)
    c_inflation = parameter(20.0, "cmH2O", "c of the sigmoid while inhaling")
    c_deflation = parameter(10.0, "cmH2O", "c of the sigmoid while exhaling")
    d = parameter(5.0, "cmH2O", "d of the sigmoid", at_least=1e-6)
    n_inflation = parameter(70_000.0, "1", "largest N while inhaling", at_least=0.0)
    n_deflation = parameter(100.0, "1", "smallest N, and N while exhaling", at_least=0.0)
    pressure_range = parameter(40.0, "cmH2O", "swing of P in one phase")
    band = parameter(0.5, "L", "shortfall of volume at which N is largest", at_least=1e-6)
    period = parameter(4.0, "s", "length of one breath", at_least=1e-6)
    frames = parameter(120, None, "frames in one breath", at_least=2)
    law = parameter("limit", None, "limit, thermostat (limit in both phases) or open")
    literal_swing = parameter(False, None, "ΔP = range/frames as printed: half the swing")
    follow_bounding_box = parameter(False, None, "compare f(P) with the box's volume")

    @property
    def frame_length(self) -> float:
        return self.period / self.frames

    def exit_initialization_mode(self) -> None:
        self.require(
            self.law in ("limit", "thermostat", "open"), "law", "'limit', 'thermostat' or 'open'"
        )
        self.require(self.frames % 2 == 0, "frames", "an even number")
        self.target_volume = self._f(0.0, self.c_inflation)

    def act(self, frame: Frame) -> None:
        into_breath = frame.number % self.frames
        inhaling = into_breath < self.frames // 2
        steps = into_breath + 1 if inhaling else self.frames - into_breath - 1
        delta_p = self.pressure_range / (self.frames if self.literal_swing else self.frames / 2)
        p = min(delta_p * steps, self.pressure_range)
        c = self.c_inflation if inhaling else self.c_deflation

        self.phase = INHALING if inhaling else EXHALING
        self.respiratory_pressure, self.target_volume = p, self._f(p, c)
        self.delta_p = delta_p if inhaling else -delta_p
        self.n = self._n(inhaling)
        self.next_frame = frame.number + 1

    def _f(self, p: float, c: float) -> float:
        """Volume that belongs to a pressure: the sigmoid."""
        b, d = self.vital_capacity, self.d
        a = self.rest_volume - b / (1 + math.exp(self.c_inflation / d))
        return a + b / (1 + math.exp(-(p - c) / d))

    def _n(self, inhaling: bool) -> float:
        """Number of molecules: from none let in, to all at a shortfall of `band` or more."""
        if self.law == "open":
            return self.n_inflation if inhaling else self.n_deflation
        if self.law == "limit" and not inhaling:
            return self.n_deflation
        volume = self.bounding_box_volume if self.follow_bounding_box else self.volume
        shortfall = min(max((self.target_volume - volume) / self.band, 0.0), 1.0)
        return self.n_deflation + (self.n_inflation - self.n_deflation) * shortfall
