"""How large outputs are, so that errors in different units can be compared."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from cosim.participant import Port
from softbody_core.ground.arrays import Floats


class Scale:
    """Largest size so far of outputs that measure the same: pressures, volumes, flows.

    A pressure that is still near 0 is so compared with the pressure behind it. An output without a
    unit, or of unit 1, stands for itself.

    Parameters
    ----------
    ports : sequence of Port
        Of the outputs.
    """

    def __init__(self, ports: Sequence[Port]) -> None:
        kinds: list[Hashable] = [
            port.unit.dimension if port.unit is not None and port.unit.dimension else index
            for index, port in enumerate(ports)
        ]
        known = list(dict.fromkeys(kinds))
        self._kinds = np.array([known.index(kind) for kind in kinds], int)
        self._factors = np.array([1.0 if port.unit is None else port.unit.factor for port in ports])
        self._largest = np.zeros(len(known))

    def update(self, values: Floats) -> Floats:
        """Take note of values, and return what size counts for each, in its own unit.

        It is 1 where all were 0.
        """
        np.maximum.at(self._largest, self._kinds, np.abs(values) * self._factors)
        largest = self._largest[self._kinds] / self._factors
        return np.where(largest > 0, largest, 1.0)

    def get_state(self) -> Any:
        """Sizes so far, as a list."""
        return self._largest.tolist()

    def set_state(self, state: Any) -> None:
        """Go back to what `get_state` gave."""
        self._largest = np.array(state, float)
