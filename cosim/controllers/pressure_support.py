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
from typing import ClassVar, Final

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.default_experiment import DefaultExperiment

INHALING, EXHALING = 1, 0
INPUT, OUTPUT = Fmi2Causality.input, Fmi2Causality.output
STATE, PARAMETER = Fmi2Causality.local, Fmi2Causality.parameter
VARIABILITY: Final = {INPUT: Fmi2Variability.continuous, PARAMETER: Fmi2Variability.fixed}

VARIABLES: Final = {
    "flow": (INPUT, 0.0, "L/min", "flow into the lung"),
    "delta_p": (OUTPUT, 0.0, "cmH2O", "pressure across the wall: airway's and muscles'"),
    "respiratory_pressure": (OUTPUT, 0.0, "cmH2O", "airway pressure"),
    "muscle_pressure": (OUTPUT, 0.0, "cmH2O", "pressure that the patient's muscles make"),
    "phase": (OUTPUT, INHALING, None, "1 inhaling, from trigger to cycling off; 0 exhaling"),
    "trigger_time": (STATE, 0.0, "s", "time at which the breath was triggered"),
    "peak_flow": (STATE, 0.0, "L/min", "largest flow of the breath"),
    "peep": (PARAMETER, 5.0, "cmH2O", "positive end-expiratory pressure"),
    "support": (PARAMETER, 10.0, "cmH2O", "pressure above PEEP while inhaling"),
    "rise_time": (PARAMETER, 0.1, "s", "time in which the support is built up"),
    "trigger_flow": (PARAMETER, 2.0, "L/min", "flow that triggers a breath"),
    "cycle_off": (PARAMETER, 0.25, "1", "share of the peak flow at which the breath ends"),
    "longest_inspiration": (PARAMETER, 3.0, "s", "time after which a breath ends in any case"),
    "effort": (PARAMETER, 5.0, "cmH2O", "peak of the patient's effort"),
    "effort_time": (PARAMETER, 1.0, "s", "length of the patient's effort"),
    "rate": (PARAMETER, 15.0, "1/min", "the patient's efforts a minute"),
    "frame": (PARAMETER, 1 / 30, "s", "time between two actions"),
}
"""Causality, start, unit and description."""


class PressureSupport(Fmi2Slave):
    """Pressure-support ventilation of a patient who breathes."""

    description = "Pressure support: triggered and cycled off by flow, with the patient's effort"
    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True
    units: ClassVar = {name: unit for name, (_, _, unit, _) in VARIABLES.items() if unit}
    bounds: ClassVar = {
        **dict.fromkeys(["peep", "support", "rise_time", "effort"], (0.0, None)),
        **dict.fromkeys(["trigger_flow", "longest_inspiration", "effort_time"], (1e-6, None)),
        **dict.fromkeys(["rate", "frame"], (1e-6, None)),
        "cycle_off": (0.0, 1.0),
    }

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
        if self.effort_time >= 60.0 / self.rate:
            raise ValueError(
                f"effort_time = {self.effort_time} s: expected less than the breath's "
                f"{60.0 / self.rate:.4g} s"
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
        if self.phase == EXHALING and self.flow > self.trigger_flow:
            self.phase, self.trigger_time, self.peak_flow = INHALING, time, self.flow
        elif self.phase == INHALING:
            self.peak_flow = max(self.peak_flow, self.flow)
            fallen = self.flow < self.cycle_off * self.peak_flow
            if fallen or time - self.trigger_time >= self.longest_inspiration:
                self.phase = EXHALING
        risen = (time - self.trigger_time + self.frame) / max(self.rise_time, self.frame)
        support = self.support * min(risen, 1.0) if self.phase == INHALING else 0.0
        self.respiratory_pressure = self.peep + support
        into_effort = time % (60.0 / self.rate) / self.effort_time
        self.muscle_pressure = self.effort * math.sin(math.pi * min(into_effort, 1.0))
        self.delta_p = self.respiratory_pressure + self.muscle_pressure
