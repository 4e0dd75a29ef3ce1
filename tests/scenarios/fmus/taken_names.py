"""Drives a body, and has outputs with names that a dataset takes for itself."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class TakenNames(Fmi2Slave):
    """A steady pressure, and a clock of its own."""

    units = {"delta_p": "cmH2O"}  # noqa: RUF012 - as a user would write it

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.delta_p = 5.0
        self.time = self.position = self.snapshot_time = self.volume = 7.0
        for name in ("delta_p", "time", "position", "snapshot_time", "volume"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        return True
