"""Saved states of an FMU."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class SavedFmu:
    """A state that the FMU keeps, and the outputs that belong to it."""

    state: Any
    values: Mapping[str, float]


def to_bytes(fmu: Any, values: Mapping[str, float]) -> bytes:
    """Write down the state of an FMU of fmpy's: its outputs as JSON in one line, then its own."""
    state = fmu.getFMUState()
    try:
        own: bytes = fmu.serializeFMUState(state)
    finally:
        fmu.freeFMUState(state)
    return json.dumps(dict(values)).encode() + b"\n" + own


def from_bytes(fmu: Any, data: bytes) -> dict[str, float]:
    """Put an FMU into the state that `to_bytes` wrote down, and return the outputs."""
    line, _, own = data.partition(b"\n")
    values: dict[str, float] = json.loads(line)
    state = fmu.deserializeFMUState(own)
    try:
        fmu.setFMUState(state)
    finally:
        fmu.freeFMUState(state)
    return values
