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
from typing import ClassVar, Final

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.default_experiment import DefaultExperiment

INHALING, EXHALING = 1, 0
INPUT, OUTPUT = Fmi2Causality.input, Fmi2Causality.output
STATE, PARAMETER = Fmi2Causality.local, Fmi2Causality.parameter
VARIABILITY: Final = {INPUT: Fmi2Variability.continuous, PARAMETER: Fmi2Variability.fixed}

VARIABLES: Final = {
    "volume": (INPUT, 0.0, "L", "enclosed volume of the lung"),
    "delta_p": (OUTPUT, 0.0, "cmH2O", "pressure difference across the wall"),
    "respiratory_pressure": (OUTPUT, 0.0, "cmH2O", "P of the limbs"),
    "target_volume": (OUTPUT, 0.0, "L", "volume of the limb at P, wanted at the end of the frame"),
    "phase": (OUTPUT, EXHALING, None, "1 inhaling, 0 exhaling"),
    "next_frame": (STATE, 0, None, "frames done"),
    "last_volume": (STATE, 0.0, "L", "volume at the start of the last frame"),
    "reversal_pressure": (STATE, 0.0, "cmH2O", "P of the last reversal"),
    "reversal_volume": (STATE, 0.0, "L", "volume of the last reversal"),
    "asymptote": (PARAMETER, 2.4, "L", "a, which no deflation goes below"),
    "vital_capacity": (PARAMETER, 3.5, "L", "b, between the asymptotes"),
    "c_inflation": (PARAMETER, 20.0, "cmH2O", "c of the inflation limb"),
    "c_deflation": (PARAMETER, 10.0, "cmH2O", "c of the deflation limb"),
    "d": (PARAMETER, 5.0, "cmH2O", "d of both limbs"),
    "pressure_low": (PARAMETER, 0.0, "cmH2O", "lowest P"),
    "pressure_high": (PARAMETER, 30.0, "cmH2O", "highest P"),
    "period": (PARAMETER, 4.0, "s", "length of one breath"),
    "frames": (PARAMETER, 120, None, "frames in one breath"),
    "resistance": (PARAMETER, 5.0, "cmH2O.s/L", "airway resistance that the controller assumes"),
    "pressure_limit": (PARAMETER, 100.0, "cmH2O", "largest delta_p, either way"),
}
"""Causality, start, unit and description."""

CLOSING: Final = 2.0
"""Frames in which a missing volume is made up."""


class Hysteresis(Fmi2Slave):
    """Pressure-volume controller with hysteresis."""

    description = "Pressure-volume hysteresis: two sigmoid limbs, re-based at each reversal"
    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True
    units: ClassVar = {name: unit for name, (_, _, unit, _) in VARIABLES.items() if unit}
    bounds: ClassVar = {
        **dict.fromkeys(["asymptote", "pressure_limit"], (0.0, None)),
        **dict.fromkeys(["vital_capacity", "d", "period", "resistance"], (1e-6, None)),
        "frames": (2, None),
    }

    delta_p: float
    target_volume: float
    reversal_volume: float
    asymptote: float
    vital_capacity: float
    phase: int

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        for name, (causality, start, _, said) in VARIABLES.items():
            setattr(self, name, start)
            kind = Integer if isinstance(start, int) else Real
            variability = VARIABILITY.get(causality, Fmi2Variability.discrete)
            self.register_variable(
                kind(name, causality=causality, variability=variability, description=said)
            )

    def exit_initialization_mode(self) -> None:
        if self.frames % 2:
            raise ValueError(f"frames = {self.frames}: expected an even number")
        if self.pressure_low > self.pressure_high:
            raise ValueError(
                f"pressure_low = {self.pressure_low}: expected at most pressure_high = "
                f"{self.pressure_high}"
            )

    def do_step(self, current_time: float, step_size: float) -> bool:
        # A millionth of a frame of slack: frames that fall on communication points stay on them.
        frame = self.period / self.frames
        while self.next_frame < (current_time + step_size) / frame - 1e-6:
            self._act(frame)
            self.next_frame += 1
        return True

    def _act(self, frame: float) -> None:
        """Set the outputs for one frame of that length."""
        if self.next_frame == 0:
            self.last_volume, self.respiratory_pressure = self.volume, self.pressure_low
            top = self.asymptote + self.vital_capacity
            self.target_volume = min(max(self.volume, self.asymptote), top)
        into_breath = self.next_frame % self.frames
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
        pressure = self.delta_p + self.resistance * missing / frame
        self.delta_p = min(max(pressure, -self.pressure_limit), self.pressure_limit)
        self.last_volume = self.volume

    def _limb(self, pressure: float) -> float:
        """Volume on the limb that started at the last reversal."""
        if self.phase == INHALING:
            start, here = self.reversal_pressure - self.c_inflation, pressure - self.c_inflation
            top = self.asymptote + self.vital_capacity
            share = math.exp(_softplus(start / self.d) - _softplus(here / self.d))
            return top - (top - self.reversal_volume) * share
        start, here = self.c_deflation - self.reversal_pressure, self.c_deflation - pressure
        share = math.exp(_softplus(start / self.d) - _softplus(here / self.d))
        return self.asymptote + (self.reversal_volume - self.asymptote) * share


def _softplus(x: float) -> float:
    """Work out log(1 + e^x) without overflow; g and h are e^(−softplus)."""
    return max(x, 0.0) + math.log1p(math.exp(-abs(x)))
