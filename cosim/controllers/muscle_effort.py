"""Spontaneous breathing: the pressure of the respiratory muscles, and nothing else.

In each breath of length T = Ti + Te it rises as a parabola for Ti, and falls exponentially after:

    P(t) = P_max t (T − t) / (Ti Te)                                              0 ≤ t ≤ Ti
    P(t) = P_max (e^(−(t − Ti)/τ) − e^(−Te/τ)) / (1 − e^(−Te/τ))                 Ti ≤ t ≤ T

which is continuous, 0 at both ends of a breath, and largest at Ti ≤ T/2 (Albanese, Cheng, Ursino &
Chbat, Am J Physiol Heart Circ Physiol 2016;310:H899, with the sign of a pressure that inflates). It
acts at the start of each frame.
"""

from __future__ import annotations

import math
from typing import ClassVar, Final

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.default_experiment import DefaultExperiment

INHALING, EXHALING = 1, 0
OUTPUT, PARAMETER = Fmi2Causality.output, Fmi2Causality.parameter

VARIABLES: Final = {
    "delta_p": (OUTPUT, 0.0, "cmH2O", "pressure difference across the wall"),
    "respiratory_pressure": (OUTPUT, 0.0, "cmH2O", "muscle pressure, the same as delta_p"),
    "phase": (OUTPUT, INHALING, None, "1 while the muscles contract, 0 while they relax"),
    "effort": (PARAMETER, 10.0, "cmH2O", "largest muscle pressure, P_max"),
    "rate": (PARAMETER, 15.0, "1/min", "breaths a minute"),
    "inspiratory_time": (PARAMETER, 1.6, "s", "time in which the muscles contract, Ti"),
    "release_time": (PARAMETER, 0.5, "s", "time constant with which they relax, τ"),
    "frame": (PARAMETER, 1 / 30, "s", "time between two actions"),
}
"""Causality, start, unit and description."""


class MuscleEffort(Fmi2Slave):
    """Spontaneous breathing."""

    description = "Spontaneous breathing: muscle pressure with an exponential release"
    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True
    units: ClassVar = {name: unit for name, (_, _, unit, _) in VARIABLES.items() if unit}
    bounds: ClassVar = {
        "effort": (0.0, None),
        **dict.fromkeys(["rate", "inspiratory_time", "release_time", "frame"], (1e-6, None)),
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
        if self.inspiratory_time > 30.0 / self.rate:
            raise ValueError(
                f"inspiratory_time = {self.inspiratory_time} s: expected at most half of the "
                f"breath, {30.0 / self.rate:.4g} s"
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
        period = 60.0 / self.rate
        into_breath, expiration = time % period, period - self.inspiratory_time
        if into_breath < self.inspiratory_time:
            self.phase = INHALING
            share = into_breath * (period - into_breath) / (self.inspiratory_time * expiration)
        else:
            self.phase = EXHALING
            # The law, with e^(−(t − Ti)/τ) taken out: no difference of nearly equal numbers.
            left = math.expm1((into_breath - period) / self.release_time)
            relaxed = math.exp((self.inspiratory_time - into_breath) / self.release_time)
            share = relaxed * left / math.expm1(-expiration / self.release_time)
        self.delta_p = self.respiratory_pressure = self.effort * share
