"""Pressure-controlled ventilation: a square wave of airway pressure.

PEEP all the time, and the driving pressure on top of it during the inspiratory time of each breath;
N is constant. The closed form of a lung of resistance R and compliance C under it is
V_T = C ΔP (1 − e^(−Ti/RC)) (1 − e^(−Te/RC)) / (1 − e^(−T/RC)) in the periodic state.
"""

from __future__ import annotations

from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real
from pythonfmu.default_experiment import DefaultExperiment

INHALING, EXHALING = 1, 0


class PressureControl(Fmi2Slave):
    """Pressure-controlled ventilation."""

    description = "Pressure-controlled ventilation: PEEP and a square wave of driving pressure"
    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True
    units: ClassVar[dict[str, str]] = {
        **dict.fromkeys(["delta_p", "respiratory_pressure", "peep", "driving_pressure"], "cmH2O"),
        "inspiratory_time": "s",
        "rate": "1/min",
        "n": "1",
        "constant_n": "1",
    }
    bounds: ClassVar[dict[str, tuple[float | None, float | None]]] = {
        "inspiratory_time": (0.0, None),
        "rate": (1e-6, None),
        "constant_n": (0.0, None),
    }

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.delta_p = 0.0
        self.n = 0.0
        self.respiratory_pressure = 0.0
        self.phase = INHALING
        self.peep = 5.0
        self.driving_pressure = 15.0
        self.inspiratory_time = 1.5
        self.rate = 15.0
        self.constant_n = 0.0
        said = {
            "delta_p": "pressure difference across the wall",
            "n": "number proportional to the molecules inside",
            "respiratory_pressure": "airway pressure, the same as delta_p",
        }
        for name, text in said.items():
            self.register_variable(
                Real(
                    name,
                    causality=Fmi2Causality.output,
                    description=text,
                    variability=Fmi2Variability.discrete,
                )
            )
        self.register_variable(
            Integer(
                "phase",
                causality=Fmi2Causality.output,
                description="1 inhaling, 0 exhaling",
                variability=Fmi2Variability.discrete,
            )
        )
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        said = {
            "peep": "positive end-expiratory pressure",
            "driving_pressure": "pressure above PEEP while inhaling",
            "inspiratory_time": "length of the inspiratory phase",
            "rate": "breaths a minute",
            "constant_n": "N, all the time",
        }
        for name, text in said.items():
            self.register_variable(Real(name, description=text, **fixed))

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
