"""Where a dataset comes from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Provenance:
    """Everything that decides the result of a run, beside the program.

    Attributes
    ----------
    scenario_name : str
        For messages.
    scenario : str
        Its text, with paths that hold everywhere.
    positions_every : float or None
        Interval of the snapshots, s.
    controller_sha256 : str or None
        Hash of the controller's FMU, if there is one.
    versions : mapping
        Of Python and of the libraries that decide a result, by name.
    machine : mapping
        Its processor, its system, and the BLAS behind NumPy and SciPy.
    """

    scenario_name: str
    scenario: str
    positions_every: float | None
    controller_sha256: str | None
    versions: Mapping[str, str]
    machine: Mapping[str, str]

    def attributes(self) -> dict[str, str]:
        """Attributes by which a dataset tells it."""
        return {
            "scenario": self.scenario,
            "scenario_name": self.scenario_name,
            "versions": json.dumps(self.versions),
            "machine": json.dumps(self.machine),
        }
