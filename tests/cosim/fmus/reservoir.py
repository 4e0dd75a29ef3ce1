"""An FMI 3.0 participant: a tank that an input flow fills."""

from pythonfmu3 import (
    Boolean,
    Float64,
    Fmi3Causality,
    Fmi3Slave,
    Fmi3StepResult,
    Fmi3Variability,
    Int32,
)
from pythonfmu3.unit import Unit


class Reservoir(Fmi3Slave):
    """Integrates a flow; overflows, and then ends the simulation or fails."""

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.time = 0.0
        self.flow = 0.0
        self.volume = 0.0
        self.fills = 0
        self.capacity = 5.0
        self.strict = False
        self.register_units([Unit("L", m=3, factor=0.001), Unit("L/s", m=3, s=-1, factor=0.001)])
        parameter = {
            "causality": Fmi3Causality.parameter,
            "variability": Fmi3Variability.tunable,
        }
        self.register_variable(
            Float64(
                "time",
                causality=Fmi3Causality.independent,
                variability=Fmi3Variability.continuous,
            )
        )
        self.register_variable(Float64("flow", causality=Fmi3Causality.input, unit="L/s"))
        self.register_variable(Float64("volume", causality=Fmi3Causality.output, unit="L"))
        self.register_variable(Int32("fills", causality=Fmi3Causality.output))
        self.register_variable(Float64("capacity", unit="L", **parameter))
        self.register_variable(Boolean("strict", **parameter))

    def do_step(self, current_time: float, step_size: float) -> Fmi3StepResult:
        self.volume += self.flow * step_size
        self.fills += 1
        full = self.volume > self.capacity
        if full and self.strict:
            raise OverflowError("the tank runs over")
        return Fmi3StepResult(terminateSimulation=full)
