"""What was measured of a statement of the paper."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from scenarios.studies.paper.scenes import Datasets


class Measurement(NamedTuple):
    """What was measured, in words, and whether the statement holds."""

    measured: str
    holds: bool


@dataclass(frozen=True)
class Statement:
    """One statement of the paper.

    Attributes
    ----------
    where : str
        Section, figure or table.
    says : str
        What it says; in quotation marks where these are its words.
    scenes : tuple of str
        Whose datasets it needs.
    measure : callable
        From those datasets to what was measured.
    """

    where: str
    says: str
    scenes: tuple[str, ...]
    measure: Callable[[Datasets], Measurement]


def listed(values: Iterable[float], form: str) -> str:
    """Write numbers down, one format for all."""
    return ", ".join(f"{value:{form}}" for value in values)


def increasing(values: Iterable[float]) -> bool:
    """Whether each value is larger than the one before it."""
    return all(low < high for low, high in pairwise(values))
