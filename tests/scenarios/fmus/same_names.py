"""The controller of `other_names.py`, with the body's names and with its units."""

from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class SameNames(Fmi2Slave):
    """Pushes 5 mbar for each litre that is missing of 3 L."""

    units: ClassVar[dict[str, str]] = {"volume": "L", "delta_p": "mbar"}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.volume = 2.5
        self.delta_p = 0.0
        self.register_variable(Real("volume", causality=Fmi2Causality.input))
        self.register_variable(Real("delta_p", causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        self.delta_p = 5.0 * (3.0 - self.volume)
        return True
