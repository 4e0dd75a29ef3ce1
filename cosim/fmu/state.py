"""States of an FMU: kept by the FMU itself, or written down."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class FmuState:
    """A state that the FMU keeps, and the outputs that belong to it."""

    state: Any
    values: Mapping[str, float]


def serialize(fmu: Any, values: Mapping[str, float]) -> bytes:
    """Write down the state of an FMU of fmpy's: its outputs as JSON in one line, then its own."""
    state = fmu.getFMUState()
    try:
        data: bytes = fmu.serializeFMUState(state)
    finally:
        fmu.freeFMUState(state)
    return json.dumps(dict(values)).encode() + b"\n" + data


def deserialize(fmu: Any, data: bytes) -> dict[str, float]:
    """Put an FMU into the state that `serialize` wrote down, and return the outputs."""
    line, _, state_data = data.partition(b"\n")
    values: dict[str, float] = json.loads(line)
    state = fmu.deserializeFMUState(state_data)
    try:
        fmu.setFMUState(state)
    finally:
        fmu.freeFMUState(state)
    return values
