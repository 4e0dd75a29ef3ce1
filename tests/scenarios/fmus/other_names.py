"""A controller whose ports have names of their own, one without a unit and one with a wrong one."""

from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class OtherNames(Fmi2Slave):
    """Pushes 5 mbar for each litre that is missing of 3 L."""

    units: ClassVar[dict[str, str]] = {"Paw": "Pa"}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.V_lung = 2500.0
        self.Paw = 0.0
        self.register_variable(Real("V_lung", causality=Fmi2Causality.input, description="mL"))
        self.register_variable(Real("Paw", causality=Fmi2Causality.output, description="in mbar"))

    def do_step(self, current_time: float, step_size: float) -> bool:
        self.Paw = 5.0 * (3000.0 - self.V_lung) / 1000.0
        return True
