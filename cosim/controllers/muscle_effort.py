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

from cosim.controllers.frame import EXHALING, INHALING, Controller, Frame, output, parameter


class MuscleEffort(Controller):
    """Spontaneous breathing."""

    description = "Spontaneous breathing: muscle pressure with an exponential release"

    delta_p = output(0.0, "cmH2O", "pressure difference across the wall")
    respiratory_pressure = output(0.0, "cmH2O", "muscle pressure, the same as delta_p")
    phase = output(INHALING, None, "1 while the muscles contract, 0 while they relax")
    effort = parameter(10.0, "cmH2O", "largest muscle pressure, P_max", at_least=0.0)
    rate = parameter(15.0, "1/min", "breaths a minute", at_least=1e-6)
    inspiratory_time = parameter(1.6, "s", "time in which the muscles contract, Ti", at_least=1e-6)
    release_time = parameter(0.5, "s", "time constant with which they relax, τ", at_least=1e-6)
    frame = parameter(1 / 30, "s", "time between two actions", at_least=1e-6)

    def exit_initialization_mode(self) -> None:
        half = 30.0 / self.rate
        self.require(
            self.inspiratory_time <= half,
            "inspiratory_time",
            f"at most half of the breath, {half:.4g} s",
        )

    def act(self, frame: Frame) -> None:
        period = 60.0 / self.rate
        into_breath, expiration = frame.time % period, period - self.inspiratory_time
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
