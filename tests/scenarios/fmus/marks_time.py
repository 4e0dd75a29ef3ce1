"""A controller that makes a file when it is 0.1 s old, for tests that wait for that."""

import os
from pathlib import Path
from typing import ClassVar

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class MarksTime(Fmi2Slave):
    """Gives a pressure, and touches the file named in SOFTBODY_TEST_MARK."""

    units: ClassVar[dict[str, str]] = {"delta_p": "cmH2O"}

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.delta_p = 0.0
        self.register_variable(Real("delta_p", causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        self.delta_p = 5.0
        if abs(current_time - 0.1) < 1e-6:
            Path(os.environ["SOFTBODY_TEST_MARK"]).touch()
        return True
