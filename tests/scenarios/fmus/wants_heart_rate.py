"""A controller with an input that no body gives."""

from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class WantsHeartRate(Fmi2Slave):
    """Takes a heart rate."""

    units: ClassVar[dict[str, str]] = {"delta_p": "cmH2O", "heart_rate": "1/min"}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.delta_p = 0.0
        self.heart_rate = 60.0
        self.register_variable(Real("delta_p", causality=Fmi2Causality.output))
        self.register_variable(Real("heart_rate", causality=Fmi2Causality.input))

    def do_step(self, current_time: float, step_size: float) -> bool:
        return True
