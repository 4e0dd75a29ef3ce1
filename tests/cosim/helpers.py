"""Small real participants, and ways to make and spoil FMUs."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, cast
from xml.etree import ElementTree as ET

from cosim import (
    ALGORITHMS,
    Causality,
    Connection,
    FmuParticipant,
    Port,
    Variability,
    cosimulate,
    unit,
)


def port(
    name: str,
    symbol: str | None,
    causality: Causality,
    *,
    optional: bool = False,
    variability: Variability = Variability.CONTINUOUS,
) -> Port:
    port_unit = None if symbol is None else unit(symbol)
    return Port(name, port_unit, causality, optional=optional, variability=variability)


class Saves:
    """What it knows of itself is its state; numbers go to bytes, too."""

    can_get_and_set_state = True
    can_serialize_state = True
    varies_step = True

    def get_state(self) -> object:
        return dict(vars(self))

    def set_state(self, state: Any) -> None:
        vars(self).update(state)

    def free_state(self, state: Any) -> None:
        """Nothing to give back."""

    def serialize(self) -> bytes:
        numbers = {k: v for k, v in vars(self).items() if isinstance(v, float)}
        return json.dumps(numbers).encode()

    def deserialize(self, data: bytes) -> None:
        vars(self).update(json.loads(data))


class Relaxation(Saves):
    """x' = rate x + gain u, solved exactly over a step with u held."""

    def __init__(self, name: str, rate: float, gain: float, x: float, symbol: str = "1") -> None:
        self.name = name
        self.ports: Mapping[str, Port] = {
            "u": port("u", symbol, Causality.INPUT),
            "x": port("x", symbol, Causality.OUTPUT),
        }
        self.rate, self.gain, self.x = rate, gain, x
        self.u = math.nan
        self.calls: list[tuple[str, float]] = []

    def initialize(self, time: float) -> None:
        self.calls.append(("initialize", time))

    def begin(self) -> None:
        self.calls.append(("begin", self.u))

    def write(self, values: Mapping[str, float]) -> None:
        self.u = values["u"]
        self.calls.append(("write", self.u))

    def step(self, time: float, step: float) -> None:
        decay = math.exp(self.rate * step)
        self.x = decay * self.x + (decay - 1) / self.rate * self.gain * self.u
        self.calls.append(("step", time))

    def read(self) -> Mapping[str, float]:
        return {"x": self.x}

    def close(self) -> None:
        """Nothing to give back."""


class Source(Saves):
    """Gives one value, whatever the time."""

    def __init__(self, value: float, symbol: str | None = "1", name: str = "source") -> None:
        self.name = name
        self.ports: Mapping[str, Port] = {"y": port("y", symbol, Causality.OUTPUT)}
        self.value = value

    def initialize(self, time: float) -> None:
        """Nothing to do."""

    def begin(self) -> None:
        """Nothing to do."""

    def write(self, values: Mapping[str, float]) -> None:
        """Nothing to set."""

    def step(self, time: float, step: float) -> None:
        """Nothing changes."""

    def read(self) -> Mapping[str, float]:
        return {"y": self.value}

    def close(self) -> None:
        """Nothing to give back."""


class Sink(Source):
    """Takes one value and keeps it."""

    def __init__(
        self, symbol: str | None = "1", name: str = "sink", *, optional: bool = False
    ) -> None:
        super().__init__(math.nan, symbol, name)
        self.ports = {"u": port("u", symbol, Causality.INPUT, optional=optional)}

    def write(self, values: Mapping[str, float]) -> None:
        self.value = values.get("u", math.nan)

    def read(self) -> Mapping[str, float]:
        return {}


class Switch(Saves):
    """A mode that turns at a moment: decided at the start of a step, or within it."""

    def __init__(self, moment: float, name: str = "switch", *, at_start: bool = False) -> None:
        self.name = name
        self.ports: Mapping[str, Port] = {
            "on": Port("on", None, Causality.OUTPUT, variability=Variability.MODE),
            "y": port("y", "cmH2O", Causality.OUTPUT, variability=Variability.SAMPLED),
        }
        self.moment, self.at_start = moment, at_start
        self.on = 0.0
        self.steps: list[tuple[float, float]] = []

    def initialize(self, time: float) -> None:
        """Nothing to do."""

    def begin(self) -> None:
        """Nothing to do."""

    def write(self, values: Mapping[str, float]) -> None:
        """Nothing to set."""

    def step(self, time: float, step: float) -> None:
        self.steps.append((time, step))
        self.on = float((time if self.at_start else time + step) >= self.moment)

    def read(self) -> Mapping[str, float]:
        return {"on": self.on, "y": 10 * self.on}

    def close(self) -> None:
        """Nothing to give back."""


class Lung(Saves):
    """One compartment: V relaxes to C p with the time constant R C, solved exactly."""

    def __init__(self, resistance: float, compliance: float) -> None:
        self.name = "lung"
        self.ports: Mapping[str, Port] = {
            "p": port("p", "cmH2O", Causality.INPUT),
            "volume": port("volume", "L", Causality.OUTPUT),
            "flow": port("flow", "L/s", Causality.OUTPUT),
            "alveolar_pressure": port("alveolar_pressure", "cmH2O", Causality.OUTPUT),
        }
        self.resistance, self.compliance = resistance, compliance
        self.p = self.volume = 0.0

    def initialize(self, time: float) -> None:
        """Nothing to do."""

    def begin(self) -> None:
        """Nothing to do."""

    def write(self, values: Mapping[str, float]) -> None:
        self.p = values["p"]

    def step(self, time: float, step: float) -> None:
        rest = self.compliance * self.p
        decay = math.exp(-step / (self.resistance * self.compliance))
        self.volume = rest + (self.volume - rest) * decay

    def read(self) -> Mapping[str, float]:
        recoil = self.volume / self.compliance
        flow = (self.p - recoil) / self.resistance
        return {"volume": self.volume, "flow": flow, "alveolar_pressure": recoil}

    def close(self) -> None:
        """Nothing to give back."""


def with_extrapolation(algorithm: str, extrapolation: str) -> dict[str, str]:
    """Return the option for an algorithm that has it; nothing for one that has not."""
    known = {field.name for field in fields(cast("Any", ALGORITHMS[algorithm]))}
    return {"extrapolation": extrapolation} if "extrapolation" in known else {}


def breathe(
    fmu: Path, lung: Lung, step: float, steps: int, **parameters: Any
) -> list[Mapping[str, Mapping[str, float]]]:
    """Outputs at each communication point of a controller and a lung, connected by name."""
    controller = FmuParticipant(fmu, parameters=parameters)
    try:
        inputs = [n for n, entry in controller.ports.items() if entry.causality is Causality.INPUT]
        wires = [Connection("controller.delta_p", "lung.p")]
        wires += [Connection(f"lung.{name}", f"controller.{name}") for name in inputs]
        points = cosimulate([controller, lung], wires, step=step, steps=steps)
        return [point.outputs for point in points]
    finally:
        controller.close()


def rewritten(fmu: Path, copy: Path, edit: Callable[[ET.Element], object]) -> Path:
    """Copy of an FMU with another model description."""
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(copy, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                root = ET.fromstring(data)
                edit(root)
                data = ET.tostring(root)
            new.writestr(name, data)
    return copy


def description(fmu: Path) -> ET.Element:
    with zipfile.ZipFile(fmu) as archive:
        return ET.fromstring(archive.read("modelDescription.xml"))


def variable(root: ET.Element, name: str) -> ET.Element:
    element = root.find(f"ModelVariables/*[@name='{name}']")
    assert element is not None
    return element


def run_python(code: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run code in a Python of its own, because it may crash or spoil the process."""
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
