"""A controller with outputs beyond those that a body takes, one of them named as the body's."""

from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class TellsMore(Fmi2Slave):
    """Gives a pressure, the valve's opening, and the flow that it believes in."""

    units: ClassVar[dict[str, str]] = {"delta_p": "Pa", "opening": "1", "flow": "L/min"}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.delta_p = 0.0
        self.opening = 0.0
        self.flow = 0.0
        for name, text in {"delta_p": "", "opening": "opening of the valve", "flow": ""}.items():
            self.register_variable(
                Real(name, causality=Fmi2Causality.output, description=text or None)
            )

    def do_step(self, current_time: float, step_size: float) -> bool:
        self.delta_p = 98.0665
        self.opening = 0.25
        self.flow = 30.0
        return True
