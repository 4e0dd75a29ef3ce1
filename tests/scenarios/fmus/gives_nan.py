"""A controller whose output is NaN after a while."""

import math
from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class GivesNan(Fmi2Slave):
    """Gives a pressure, and no number from 0.5 s on."""

    units: ClassVar[dict[str, str]] = {"delta_p": "cmH2O"}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.delta_p = 0.0
        self.register_variable(Real("delta_p", causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        self.delta_p = 5.0 if current_time < 0.5 - 1e-9 else math.nan
        return True
