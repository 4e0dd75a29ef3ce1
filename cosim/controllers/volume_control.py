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
    "respiratory_pressure": (OUTPUT, 0.0, "cmH2O", "airway pressure, the same as delta_p"),
    "target_volume": (OUTPUT, 0.0, "L", "volume wanted at the end of the frame"),
    "phase": (OUTPUT, INHALING, None, "1 inhaling, the pause included; 0 exhaling"),
    "breaths": (STATE, 0, None, "breaths begun"),
    "start_volume": (STATE, 0.0, "L", "volume at the start of the breath"),
    "last_volume": (STATE, 0.0, "L", "volume at the start of the last frame"),
    "tidal_volume": (PARAMETER, 0.5, "L", "volume given with each breath"),
    "rate": (PARAMETER, 15.0, "1/min", "breaths a minute"),
    "inspiratory_time": (PARAMETER, 1.5, "s", "length of the inspiratory phase with its pause"),
    "pause": (PARAMETER, 0.3, "s", "time without flow at its end"),
    "peep": (PARAMETER, 5.0, "cmH2O", "positive end-expiratory pressure"),
    "resistance": (PARAMETER, 5.0, "cmH2O.s/L", "airway resistance that the controller assumes"),
    "pressure_limit": (PARAMETER, 100.0, "cmH2O", "largest airway pressure"),
    "frame": (PARAMETER, 1 / 30, "s", "time between two actions"),
}
"""Causality, start, unit and description."""

CLOSING: Final = 2.0
"""Frames in which a missing volume is made up."""


class VolumeControl(Fmi2Slave):
    """Volume-controlled ventilation."""

    description = "Volume-controlled ventilation: constant flow and an inspiratory pause"
    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True
    units: ClassVar = {name: unit for name, (_, _, unit, _) in VARIABLES.items() if unit}
    bounds: ClassVar = {
        **dict.fromkeys(["tidal_volume", "pause", "peep", "pressure_limit"], (0.0, None)),
        **dict.fromkeys(["rate", "inspiratory_time", "resistance", "frame"], (1e-6, None)),
    }

    breaths: int
    start_volume: float
    last_volume: float
    respiratory_pressure: float
    tidal_volume: float

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
        if not self.pause < self.inspiratory_time < 60.0 / self.rate:
            raise ValueError(
                f"inspiratory_time = {self.inspiratory_time} s: expected more than the pause of "
                f"{self.pause} s and less than the breath's {60.0 / self.rate:.4g} s"
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
        breath, into_breath = divmod(time, 60.0 / self.rate)
        if breath >= self.breaths:
            self.last_volume = self.last_volume if self.breaths else self.volume
            self.start_volume, self.breaths = self.volume, int(breath) + 1
        inhaling = into_breath < self.inspiratory_time
        self.phase = INHALING if inhaling else EXHALING
        due, self.target_volume = self._wanted(into_breath), self._wanted(into_breath + self.frame)
        if inhaling:
            wanted = (self.target_volume - due) + (due - self.volume) / CLOSING
            missing = wanted - (self.volume - self.last_volume)
            pressure = self.respiratory_pressure + self.resistance * missing / self.frame
            self.respiratory_pressure = min(max(pressure, 0.0), self.pressure_limit)
        else:
            self.respiratory_pressure = self.peep
        self.delta_p = self.respiratory_pressure
        self.last_volume = self.volume

    def _wanted(self, into_breath: float) -> float:
        """Volume that the lung should have."""
        share: float = min(into_breath / (self.inspiratory_time - self.pause), 1.0)
        return self.start_volume + self.tidal_volume * share
