"""A lung with a closed form, in participants that solve their own part of it exactly.

Mead's two compartments in series: the airways, of resistance R₁ and compliance C₁, and behind them
the alveoli, of R₂ and C₂, under a ventilator whose pressure is a raised cosine. With inputs held
over a step each participant is exact, so all that errs is the coupling.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from cosim import Causality, Connection, Port
from tests.cosim.helpers import Saves, port

R1, R2, C1, C2 = 2.0, 10.0, 0.05, 0.1  # cmH2O.s/L and L/cmH2O: time constants 0.08 s and 1 s
SWING, PERIOD = 15.0, 4.0

WIRES = [
    Connection("ventilator.p", "airways.p_mouth"),
    Connection("alveoli.p", "airways.p_alveoli"),
    Connection("airways.p", "alveoli.p_airways"),
]


class Ventilator(Saves):
    """p = SWING (1 − cos 2πt/PERIOD)/2."""

    def __init__(self) -> None:
        self.name = "ventilator"
        self.ports: Mapping[str, Port] = {"p": port("p", "cmH2O", Causality.OUTPUT)}
        self.time = 0.0

    def initialize(self, time: float) -> None:
        self.time = time

    def begin(self) -> None:
        """Nothing to do."""

    def write(self, values: Mapping[str, float]) -> None:
        """Nothing to set."""

    def step(self, time: float, step: float) -> None:
        self.time = time + step

    def read(self) -> Mapping[str, float]:
        return {"p": SWING * (1 - math.cos(2 * math.pi * self.time / PERIOD)) / 2}

    def close(self) -> None:
        """Nothing to give back."""


class Compartment(Saves):
    """C p' = Σ (p_k − p)/R_k over its neighbours, solved exactly with their pressures held."""

    def __init__(self, name: str, compliance: float, neighbours: Mapping[str, float]) -> None:
        self.name = name
        self.ports: Mapping[str, Port] = {
            "p": port("p", "cmH2O", Causality.OUTPUT),
            **{f"p_{n}": port(f"p_{n}", "cmH2O", Causality.INPUT) for n in neighbours},
        }
        self.compliance, self.neighbours = compliance, neighbours
        self.p = 0.0
        self.held: Mapping[str, float] = {}

    def initialize(self, time: float) -> None:
        """Nothing to do."""

    def begin(self) -> None:
        """Nothing to do."""

    def write(self, values: Mapping[str, float]) -> None:
        self.held = dict(values)

    def step(self, time: float, step: float) -> None:
        conductance = sum(1 / r for r in self.neighbours.values())
        rest = sum(self.held[f"p_{n}"] / r for n, r in self.neighbours.items()) / conductance
        self.p = rest + (self.p - rest) * math.exp(-step * conductance / self.compliance)

    def read(self) -> Mapping[str, float]:
        return {"p": self.p}

    def close(self) -> None:
        """Nothing to give back."""


@dataclass
class SeriesLung:
    """The three participants, new."""

    ventilator: Ventilator
    airways: Compartment
    alveoli: Compartment

    @classmethod
    def new(cls) -> SeriesLung:
        return cls(
            Ventilator(),
            Compartment("airways", C1, {"mouth": R1, "alveoli": R2}),
            Compartment("alveoli", C2, {"airways": R2}),
        )

    @property
    def participants(self) -> list[Ventilator | Compartment]:
        return [self.ventilator, self.airways, self.alveoli]

    @property
    def pressures(self) -> np.ndarray:
        return np.array([self.airways.p, self.alveoli.p])


def closed_form(time: float) -> np.ndarray:
    """Pressures in airways and alveoli: x' = A x with the cosine and a constant as states."""
    omega = 2 * math.pi / PERIOD
    a = np.zeros((5, 5))  # airways, alveoli, 1, cos, sin
    a[0, :2] = -(1 / R1 + 1 / R2) / C1, 1 / R2 / C1
    a[0, 2], a[0, 3] = SWING / 2 / R1 / C1, -SWING / 2 / R1 / C1
    a[1, :2] = 1 / R2 / C2, -1 / R2 / C2
    a[3, 4], a[4, 3] = -omega, omega
    return np.asarray(expm(a * time) @ [0.0, 0.0, 1.0, 1.0, 0.0])[:2]
