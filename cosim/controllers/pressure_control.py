"""Pressure-controlled ventilation: a square wave of airway pressure.

PEEP all the time, and the driving pressure on top of it during the inspiratory time of each breath;
N is constant. The closed form of a lung of resistance R and compliance C under it is
V_T = C ΔP (1 − e^(−Ti/RC)) (1 − e^(−Te/RC)) / (1 − e^(−T/RC)) in the periodic state.
"""

from __future__ import annotations

from typing import ClassVar, Final

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.default_experiment import DefaultExperiment

INHALING, EXHALING = 1, 0
OUTPUT, PARAMETER = Fmi2Causality.output, Fmi2Causality.parameter

VARIABLES: Final = {
    "delta_p": (OUTPUT, 0.0, "cmH2O", "pressure difference across the wall"),
    "n": (OUTPUT, 0.0, "1", "number proportional to the molecules inside"),
    "respiratory_pressure": (OUTPUT, 0.0, "cmH2O", "airway pressure, the same as delta_p"),
    "phase": (OUTPUT, INHALING, None, "1 inhaling, 0 exhaling"),
    "peep": (PARAMETER, 5.0, "cmH2O", "positive end-expiratory pressure"),
    "driving_pressure": (PARAMETER, 15.0, "cmH2O", "pressure above PEEP while inhaling"),
    "inspiratory_time": (PARAMETER, 1.5, "s", "length of the inspiratory phase"),
    "rate": (PARAMETER, 15.0, "1/min", "breaths a minute"),
    "constant_n": (PARAMETER, 0.0, "1", "N, all the time"),
}
"""Causality, start, unit and description."""


class PressureControl(Fmi2Slave):
    """Pressure-controlled ventilation."""

    description = "Pressure-controlled ventilation: PEEP and a square wave of driving pressure"
    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True
    units: ClassVar = {name: unit for name, (_, _, unit, _) in VARIABLES.items() if unit}
    bounds: ClassVar = {
        "inspiratory_time": (0.0, None),
        "rate": (1e-6, None),
        "constant_n": (0.0, None),
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
        if self.inspiratory_time >= 60.0 / self.rate:
            raise ValueError(
                f"inspiratory_time = {self.inspiratory_time} s: expected less than the breath's "
                f"{60.0 / self.rate:.4g} s"
            )

    def do_step(self, current_time: float, step_size: float) -> bool:
        period = 60.0 / self.rate
        # A billionth of a breath of slack keeps a switch on the communication point it falls on.
        into_breath = (current_time + 1e-9 * period) % period
        inhaling = into_breath < self.inspiratory_time
        self.phase = INHALING if inhaling else EXHALING
        self.delta_p = self.peep + (self.driving_pressure if inhaling else 0.0)
        self.respiratory_pressure = self.delta_p
        self.n = self.constant_n
        return True
