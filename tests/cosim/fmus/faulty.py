"""An FMI 2.0 controller that goes wrong on request."""

from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real, String
from pythonfmu.enums import Fmi2Status


class Faulty(Fmi2Slave):
    """Gives y = 2 u until it is told to fail."""

    units: ClassVar[dict[str, str]] = {"u": "1", "y": "1"}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.u = 0.0
        self.y = 0.0
        self.fault = "none"
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        self.register_variable(
            String("fault", causality=Fmi2Causality.parameter, variability=Fmi2Variability.fixed)
        )

    def exit_initialization_mode(self) -> None:
        if self.fault == "initialization":
            raise ValueError("the valve is shut")
        self.log("ready to start", Fmi2Status.ok)

    def do_step(self, current_time: float, step_size: float) -> bool:
        if self.fault == "step":
            raise RuntimeError("the pump has stopped")
        self.y = float("nan") if self.fault == "nan" else 2 * self.u
        return self.fault != "refusal"

    def terminate(self) -> None:
        if self.fault == "termination":
            raise RuntimeError("the switch is stuck")
