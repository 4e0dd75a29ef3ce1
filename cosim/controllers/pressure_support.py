"""Pressure support: the patient starts and ends each breath, and the ventilator adds pressure.

A breath begins when the patient's effort draws a flow above the trigger. Airway pressure then rises
from PEEP to PEEP + support within the rise time. The breath ends when the flow has fallen to a
share `cycle_off` of its peak. The patient's effort is a half sine, and the wall feels the sum of
both. The first breath is given at once; without an effort there is no other. It acts at the start
of each frame.

For a lung of time constant τ = R C, without a rise time and an effort, the flow decays as e^(−t/τ),
so the breath lasts τ ln(1/cycle_off) (linear model of Hotchkiss et al., Am J Respir Crit Care Med
2002;165:47).
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


class PressureSupport(Controller):
    """Pressure-support ventilation of a patient who breathes."""

    description = "Pressure support: triggered and cycled off by flow, with the patient's effort"

    flow = input_(0.0, "L/min", "flow into the lung")
    delta_p = output(0.0, "cmH2O", "pressure across the wall: airway's and muscles'")
    respiratory_pressure = output(0.0, "cmH2O", "airway pressure")
    muscle_pressure = output(0.0, "cmH2O", "pressure that the patient's muscles make")
    phase = output(INHALING, None, "1 inhaling, from trigger to cycling off; 0 exhaling")
    trigger_time = local(0.0, "s", "time at which the breath was triggered")
    peak_flow = local(0.0, "L/min", "largest flow of the breath")
    peep = parameter(5.0, "cmH2O", "positive end-expiratory pressure", at_least=0.0)
    support = parameter(10.0, "cmH2O", "pressure above PEEP while inhaling", at_least=0.0)
    rise_time = parameter(0.1, "s", "time in which the support is built up", at_least=0.0)
    trigger_flow = parameter(2.0, "L/min", "flow that triggers a breath", at_least=1e-6)
    cycle_off = parameter(
        0.25, "1", "share of the peak flow at which the breath ends", at_least=0.0, at_most=1.0
    )
    longest_inspiration = parameter(
        3.0, "s", "time after which a breath ends in any case", at_least=1e-6
    )
    effort = parameter(5.0, "cmH2O", "peak of the patient's effort", at_least=0.0)
    effort_time = parameter(1.0, "s", "length of the patient's effort", at_least=1e-6)
    rate = parameter(15.0, "1/min", "the patient's efforts a minute", at_least=1e-6)
    frame = parameter(1 / 30, "s", "time between two actions", at_least=1e-6)

    def exit_initialization_mode(self) -> None:
        period = 60.0 / self.rate
        self.require(
            self.effort_time < period, "effort_time", f"less than the breath's {period:.4g} s"
        )

    def act(self, frame: Frame) -> None:
        if self.phase == EXHALING and self.flow > self.trigger_flow:
            self.phase, self.trigger_time, self.peak_flow = INHALING, frame.time, self.flow
        elif self.phase == INHALING:
            self.peak_flow = max(self.peak_flow, self.flow)
            fallen = self.flow < self.cycle_off * self.peak_flow
            if fallen or frame.time - self.trigger_time >= self.longest_inspiration:
                self.phase = EXHALING
        risen = (frame.time - self.trigger_time + frame.length) / max(self.rise_time, frame.length)
        support = self.support * min(risen, 1.0) if self.phase == INHALING else 0.0
        self.respiratory_pressure = self.peep + support
        into_effort = frame.time % (60.0 / self.rate) / self.effort_time
        self.muscle_pressure = self.effort * math.sin(math.pi * min(into_effort, 1.0))
        self.delta_p = self.respiratory_pressure + self.muscle_pressure
