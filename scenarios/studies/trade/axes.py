"""What a trade can vary: the values of each axis, and how a value goes into a scenario.

A new axis is one entry in `AXES`; what a trade does with it is said there, too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cosim import ALGORITHMS, quantity
from cosim.algorithms.signals import DEGREES
from scenarios.scene.scenario import Draft
from scenarios.scene.tables import choose
from scenarios.studies.trade.schemes import with_inner_step, with_integrator, with_tolerance
from scenarios.studies.trade.sizes import sizes, with_points
from softbody_core import INTEGRATORS

Value = str | float


@dataclass(frozen=True)
class TradeAxis:
    """One thing to vary.

    Attributes
    ----------
    units, long_name : str
        Of its coordinate.
    default : callable
        Its values for a scenario.
    read : callable
        From text to a value; raises `ValueError` or `UnitError`.
    put : callable
        The scenario with a value in place; None where the axis means nothing to the scheme.
    rising : bool
        Of numbers, larger ones are finer; otherwise smaller ones are.
    finest : callable, optional
        The value at which the reference runs; without one it does not depend on the axis.
    width : callable, optional
        Widths of the meshes that values stand for. The reference then runs on each of them, which
        gives an order of convergence.
    dearer : bool
        A finer value costs more for sure, so it is left out where a coarser one took too long.
    """

    units: str
    long_name: str
    default: Callable[[Draft], Sequence[Value]]
    read: Callable[[str], Value]
    put: Callable[[Draft, Any], Draft | None]
    rising: bool = False
    finest: Callable[[Sequence[Any]], Value] | None = None
    width: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None
    dearer: bool = False

    def ordered(self, values: Sequence[Any]) -> tuple[Value, ...]:
        """Put numbers in order, coarse first; names stay as they are."""
        return tuple(values) if self.read is str else tuple(sorted(values, reverse=not self.rising))


def _with_algorithm(draft: Draft, algorithm: str) -> Draft:
    """Change the algorithm; the options in the scenario stay with the one that they are for."""
    coupling = draft.read("coupling")
    if isinstance(coupling.algorithm, choose(algorithm, ALGORITHMS, "algorithm")):
        return draft
    return draft.changed({"coupling": {"algorithm": algorithm, "step": coupling.step}})


AXES: Final[dict[str, TradeAxis]] = {
    "points": TradeAxis(
        "1",
        "number of points",
        sizes,
        int,
        with_points,
        rising=True,
        finest=max,
        width=lambda points: points**-0.5,
    ),
    "communication_step": TradeAxis(
        "s",
        "communication step",
        lambda draft: [draft.read("coupling").step / parts for parts in (1, 2, 4)],
        lambda text: quantity(text, "s"),
        lambda draft, step: draft.changed({"coupling.step": step}),
        finest=min,
    ),
    "algorithm": TradeAxis(
        "1",
        "coupling algorithm",
        lambda _: list(ALGORITHMS),
        str,
        _with_algorithm,
        finest=lambda _: "gauss-seidel",
    ),
    "extrapolation": TradeAxis(
        "1",
        "polynomial by which inputs go on over a communication step",
        lambda _: list(DEGREES),
        str,
        lambda draft, name: draft.changed({"coupling.extrapolation": name}),
        finest=lambda names: max(names, key=DEGREES.__getitem__),
    ),
    "integrator": TradeAxis("1", "scheme", lambda _: list(INTEGRATORS), str, with_integrator),
    "dt": TradeAxis(
        "1",
        "inner step as a share of the scheme's longest",
        lambda _: [1.0, 0.5, 0.25, 0.125],
        float,
        with_inner_step,
        dearer=True,
    ),
    "tolerance": TradeAxis(
        "1", "tolerance", lambda _: [1e-2, 1e-3, 1e-4, 1e-5], float, with_tolerance
    ),
}
"""In the order in which they are put into a scenario: `dt` has to know the scheme."""
