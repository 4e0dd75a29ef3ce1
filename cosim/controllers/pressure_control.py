"""Pressure-controlled ventilation: a square wave of airway pressure.

PEEP all the time, and the driving pressure on top of it during the inspiratory time of each breath;
N is constant. The closed form of a lung of resistance R and compliance C under it is
V_T = C ΔP (1 − e^(−Ti/RC)) (1 − e^(−Te/RC)) / (1 − e^(−T/RC)) in the periodic state.
"""

from __future__ import annotations

from cosim.controllers.frame import EXHALING, INHALING, Controller, output, parameter


class PressureControl(Controller):
    """Pressure-controlled ventilation."""

    description = "Pressure-controlled ventilation: PEEP and a square wave of driving pressure"

    delta_p = output(0.0, "cmH2O", "pressure difference across the wall")
    n = output(0.0, "1", "number proportional to the molecules inside")
    respiratory_pressure = output(0.0, "cmH2O", "airway pressure, the same as delta_p")
    phase = output(INHALING, None, "1 inhaling, 0 exhaling")
    peep = parameter(5.0, "cmH2O", "positive end-expiratory pressure")
    driving_pressure = parameter(15.0, "cmH2O", "pressure above PEEP while inhaling")
    inspiratory_time = parameter(1.5, "s", "length of the inspiratory phase", at_least=0.0)
    rate = parameter(15.0, "1/min", "breaths a minute", at_least=1e-6)
    constant_n = parameter(0.0, "1", "N, all the time", at_least=0.0)

    def exit_initialization_mode(self) -> None:
        period = 60.0 / self.rate
        self.require(
            self.inspiratory_time < period,
            "inspiratory_time",
            f"less than the breath's {period:.4g} s",
        )

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Act at every communication point, and not at frames."""
        period = 60.0 / self.rate
        # A billionth of a breath of slack keeps a switch on the communication point it falls on.
        into_breath = (current_time + 1e-9 * period) % period
        inhaling = into_breath < self.inspiratory_time
        self.phase = INHALING if inhaling else EXHALING
        self.delta_p = self.peep + (self.driving_pressure if inhaling else 0.0)
        self.respiratory_pressure = self.delta_p
        self.n = self.constant_n
        return True
