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
from typing import ClassVar, Final

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String
from pythonfmu.default_experiment import DefaultExperiment

INHALING, EXHALING = 1, 0
INPUT, OUTPUT = Fmi2Causality.input, Fmi2Causality.output
STATE, PARAMETER = Fmi2Causality.local, Fmi2Causality.parameter
VARIABILITY: Final = {INPUT: Fmi2Variability.continuous, PARAMETER: Fmi2Variability.fixed}

VARIABLES: Final = {
    "volume": (INPUT, 0.0, "L", "enclosed volume of the lung"),
    "alveolar_pressure": (INPUT, 0.0, "cmH2O", "pressure that the tissue balances"),
    "delta_p": (OUTPUT, 0.0, "cmH2O", "pressure difference across the wall, u"),
    "target_volume": (OUTPUT, 0.0, "L", "r for the volume; the volume itself if left alone"),
    "target_pressure": (OUTPUT, 0.0, "cmH2O", "r for the pressure; the pressure if left alone"),
    "phase": (OUTPUT, INHALING, None, "1 in the first half of the period, 0 in the second"),
    "frames": (STATE, 0, None, "frames done"),
    "last_measured": (STATE, 0.0, "cmH2O", "K y of the last frame"),
    "integral": (STATE, 0.0, "cmH2O", "I"),
    "derivative": (STATE, 0.0, "cmH2O", "the derivative's part of u"),
    "quantity": (PARAMETER, "volume", None, "what follows the waveform: volume or pressure"),
    "waveform": (PARAMETER, "sine", None, "sine or square"),
    "period": (PARAMETER, 4.0, "s", "period of the waveform"),
    "volume_low": (PARAMETER, 2.5, "L", "lowest volume of the waveform"),
    "volume_high": (PARAMETER, 3.0, "L", "highest volume of the waveform"),
    "volume_gain": (PARAMETER, 50.0, "cmH2O/L", "K for the volume"),
    "pressure_low": (PARAMETER, 0.0, "cmH2O", "lowest pressure of the waveform"),
    "pressure_high": (PARAMETER, 10.0, "cmH2O", "highest pressure of the waveform"),
    "pressure_gain": (PARAMETER, 4.0, "1", "K for the pressure"),
    "integral_time": (PARAMETER, 1.0, "s", "Ti"),
    "derivative_time": (PARAMETER, 0.0, "s", "Td"),
    "delta_p_low": (PARAMETER, -50.0, "cmH2O", "lower limit of u"),
    "delta_p_high": (PARAMETER, 100.0, "cmH2O", "upper limit of u"),
    "frame": (PARAMETER, 1 / 30, "s", "time between two actions"),
}
"""Causality, start, unit and description."""

FILTER: Final = 10.0
"""Derivative time over the time constant of its filter."""


class Pid(Fmi2Slave):
    """PID control of volume or pressure."""

    description = "PID control: volume or alveolar pressure follows a waveform"
    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True
    units: ClassVar = {name: unit for name, (_, _, unit, _) in VARIABLES.items() if unit}
    bounds: ClassVar = {
        **dict.fromkeys(["volume_gain", "pressure_gain", "derivative_time"], (0.0, None)),
        **dict.fromkeys(["period", "integral_time", "frame"], (1e-6, None)),
    }

    frames: int
    last_measured: float
    derivative: float

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        kinds = {float: Real, int: Integer, str: String}
        for name, (causality, start, _, said) in VARIABLES.items():
            setattr(self, name, start)
            variability = VARIABILITY.get(causality, Fmi2Variability.discrete)
            self.register_variable(
                kinds[type(start)](
                    name, causality=causality, variability=variability, description=said
                )
            )

    def exit_initialization_mode(self) -> None:
        for name, choices in {
            "quantity": ("volume", "pressure"),
            "waveform": ("sine", "square"),
        }.items():
            if getattr(self, name) not in choices:
                raise ValueError(
                    f"{name} = {getattr(self, name)!r}: expected {' or '.join(map(repr, choices))}"
                )
        if self.integral_time < self.frame:
            raise ValueError(
                f"integral_time = {self.integral_time} s: expected at least one frame, "
                f"{self.frame:.4g} s"
            )
        for low in ("volume_low", "pressure_low", "delta_p_low"):
            high = low.replace("low", "high")
            if getattr(self, low) > getattr(self, high):
                raise ValueError(
                    f"{low} = {getattr(self, low)}: expected at most {high} = {getattr(self, high)}"
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
        share = self._waveform(time)
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
        self.derivative = (lag * self.derivative - slope) / (lag + self.frame)
        wanted = proportional + self.integral + self.derivative
        self.delta_p = min(max(wanted, self.delta_p_low), self.delta_p_high)
        excess = wanted - self.delta_p
        self.integral += self.frame / self.integral_time * (proportional - excess)

    def _waveform(self, time: float) -> float:
        """Where the waveform stands between low and high, and the phase that goes with it."""
        position = time % self.period / self.period
        self.phase = INHALING if position < 0.5 else EXHALING
        if self.waveform == "square":
            return float(self.phase)
        return (1.0 - math.cos(2 * math.pi * position)) / 2
