"""A controller that raises an exception after a while."""

from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class StuckValve(Fmi2Slave):
    """Gives a pressure until its valve sticks."""

    units: ClassVar[dict[str, str]] = {"delta_p": "cmH2O", "at": "s"}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.delta_p = 0.0
        self.at = 0.5
        self.register_variable(Real("delta_p", causality=Fmi2Causality.output))
        self.register_variable(
            Real("at", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed)
        )

    def do_step(self, current_time: float, step_size: float) -> bool:
        if current_time > self.at - 1e-9:
            raise RuntimeError("the valve is stuck")
        self.delta_p = 5.0
        return True
