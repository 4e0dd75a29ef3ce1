"""A controller without the outputs that a body needs."""

from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class DrivesNothing(Fmi2Slave):
    """Has one output, of another name."""

    units: ClassVar[dict[str, str]] = {"drive": "cmH2O"}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.drive = 0.0
        self.register_variable(Real("drive", causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        return True
