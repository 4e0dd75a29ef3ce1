"""The respiratory pressure-volume controller of Mesit & Guha (2011), section 5.

A sampled controller: it acts at the start of each frame, `frames` times a breath, and holds its
outputs in between. While inhaling, the respiratory pressure P rises by ΔP a frame, and gas is let
in as the volume falls short of the sigmoid f(P) = a + b / (1 + exp(−(P − c)/d)); while exhaling, P
falls by ΔP a frame and the gas is let out.
"""

from __future__ import annotations

import math
from typing import ClassVar

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String
from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.variables import ScalarVariable

INHALING, EXHALING = 1, 0


class PaperController(Fmi2Slave):
    """Sigmoid P-V controller of Mesit & Guha (2011)."""

    description = "Sigmoid pressure-volume controller of Mesit & Guha (2011), section 5"
    license = "MIT"
    default_experiment = DefaultExperiment(start_time=0.0, stop_time=20.0, step_size=1 / 30)
    complete_state = True
    units: ClassVar[dict[str, str]] = {
        **dict.fromkeys(["volume", "bounding_box_volume", "target_volume"], "L"),
        **dict.fromkeys(["rest_volume", "vital_capacity", "band"], "L"),
        **dict.fromkeys(["delta_p", "respiratory_pressure", "pressure_range"], "cmH2O"),
        **dict.fromkeys(["c_inflation", "c_deflation", "d"], "cmH2O"),
        **dict.fromkeys(["n", "n_inflation", "n_deflation"], "1"),
        "period": "s",
    }
    bounds: ClassVar[dict[str, tuple[float | None, float | None]]] = {
        **dict.fromkeys(["rest_volume", "n_inflation", "n_deflation"], (0.0, None)),
        **dict.fromkeys(["vital_capacity", "d", "band", "period"], (1e-6, None)),
        "frames": (2, None),
    }

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        self.volume = 0.0
        self.bounding_box_volume = 0.0
        self.delta_p = 0.0
        self.n = 0.0
        self.respiratory_pressure = 0.0
        self.target_volume = 0.0
        self.phase = INHALING
        self.next_frame = 0
        self.rest_volume = 2.5
        self.vital_capacity = 3.5
        self.c_inflation = 20.0
        self.c_deflation = 10.0
        self.d = 5.0
        self.n_inflation = 70_000.0
        self.n_deflation = 100.0
        self.pressure_range = 40.0
        self.band = 0.5
        self.period = 4.0
        self.frames = 120
        self.law = "limit"
        self.literal_swing = False
        self.follow_bounding_box = False
        self._register(
            Real,
            {
                "volume": "enclosed volume of the lung",
                "bounding_box_volume": "volume of the lung's bounding box",
            },
            causality=Fmi2Causality.input,
        )
        discrete = Fmi2Variability.discrete
        output, local = Fmi2Causality.output, Fmi2Causality.local
        self._register(
            Real,
            {
                "delta_p": "pressure difference across the wall: +ΔP inhaling, −ΔP exhaling",
                "n": "number proportional to the molecules inside",
                "respiratory_pressure": "P of the sigmoid",
                "target_volume": "f(P), the volume that the controller aims at",
            },
            causality=output,
            variability=discrete,
        )
        self._register(
            Integer, {"phase": "1 inhaling, 0 exhaling"}, causality=output, variability=discrete
        )
        self._register(
            Integer, {"next_frame": "frames done"}, causality=local, variability=discrete
        )
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self._register(
            Real,
            {
                "rest_volume": "volume at P = 0 on inflation, from which a follows",
                "vital_capacity": "b of the sigmoid",
                "c_inflation": "c of the sigmoid while inhaling",
                "c_deflation": "c of the sigmoid while exhaling",
                "d": "d of the sigmoid",
                "n_inflation": "largest N while inhaling",
                "n_deflation": "smallest N, and N while exhaling",
                "pressure_range": "swing of P in one phase",
                "band": "shortfall of volume at which N is largest",
                "period": "length of one breath",
            },
            **fixed,
        )
        self._register(Integer, {"frames": "frames in one breath"}, **fixed)
        self._register(String, {"law": "limit, thermostat (limit in both phases) or open"}, **fixed)
        self._register(
            Boolean,
            {
                "literal_swing": "ΔP = range/frames as printed: half the swing",
                "follow_bounding_box": "compare f(P) with the box's volume",
            },
            **fixed,
        )

    def _register(
        self, kind: type[ScalarVariable], said: dict[str, str], **attributes: object
    ) -> None:
        for name, description in said.items():
            self.register_variable(kind(name, description=description, **attributes))

    def exit_initialization_mode(self) -> None:
        if self.law not in ("limit", "thermostat", "open"):
            raise ValueError(f"law = {self.law!r}: expected 'limit', 'thermostat' or 'open'")
        if self.frames % 2:
            raise ValueError(f"frames = {self.frames}: expected an even number")
        self.target_volume = self._sigmoid(0.0, self.c_inflation)

    def do_step(self, current_time: float, step_size: float) -> bool:
        # A billionth of a frame of slack: frames that fall on communication points stay on them.
        frame = self.period / self.frames
        while self.next_frame * frame < current_time + step_size - 1e-9 * frame:
            self._act(self.next_frame)
            self.next_frame += 1
        return True

    def _act(self, frame: int) -> None:
        """Set the outputs for one frame."""
        into_breath = frame % self.frames
        inhaling = into_breath < self.frames // 2
        swing = self.pressure_range / (self.frames if self.literal_swing else self.frames / 2)
        frames_from_zero = into_breath + 1 if inhaling else self.frames - into_breath - 1
        self.respiratory_pressure = min(swing * frames_from_zero, self.pressure_range)
        centre = self.c_inflation if inhaling else self.c_deflation
        self.target_volume = self._sigmoid(self.respiratory_pressure, centre)
        self.delta_p = swing if inhaling else -swing
        self.phase = INHALING if inhaling else EXHALING
        self.n = self._molecules(inhaling)

    def _molecules(self, inhaling: bool) -> float:
        if self.law == "open":
            return self.n_inflation if inhaling else self.n_deflation
        if self.law == "limit" and not inhaling:
            return self.n_deflation
        volume = self.bounding_box_volume if self.follow_bounding_box else self.volume
        opening = min(max((self.target_volume - volume) / self.band, 0.0), 1.0)
        return self.n_deflation + (self.n_inflation - self.n_deflation) * opening

    def _sigmoid(self, pressure: float, centre: float) -> float:
        asymptote = self.rest_volume - self.vital_capacity / (
            1 + math.exp(self.c_inflation / self.d)
        )
        return asymptote + self.vital_capacity / (1 + math.exp(-(pressure - centre) / self.d))
