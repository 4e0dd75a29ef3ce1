"""What is held at an input over a step, where the output behind it changes all the time.

Participants hold their inputs while they step. So an output is continued beyond its last
communication points by a polynomial (Kübler & Schiehlen 2000; Busch 2016), and what is held has the
polynomial's moments: its mean over the step for order 2; for order 3, two values over the two
halves of the step that have its mean and its first moment. That two values suffice is known of
commutator-free Magnus integrators (Alvermann & Fehske 2011): a participant x' = f(x, u) then errs
by O(h⁴) in a step. The value at mid-step is the mean of a straight line; for a parabola it is not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from typing import Any, Final, Literal

import numpy as np

from cosim.algorithms.algorithm import require_variable_steps
from cosim.connection import Term, Wiring
from cosim.participant import Participant

Extrapolation = Literal["constant", "linear", "quadratic"]

DEGREES: Final[dict[str, int]] = {"constant": 0, "linear": 1, "quadratic": 2}

Outputs = Mapping[str, Mapping[str, float]]
"""Values by participant and output."""


class Signals:
    """Outputs at the last communication points, and what follows from them for a step.

    Parameters
    ----------
    participants : sequence of Participant
        Whose outputs.
    wiring : Wiring
        Where they go.
    extrapolation : str
        Key of `DEGREES`: polynomial by which continuous outputs go on. Others are held.

    Raises
    ------
    CouplingError
        If the polynomial asks for two half steps of someone whose step is fixed.
    """

    def __init__(
        self, participants: Sequence[Participant], wiring: Wiring, extrapolation: Extrapolation
    ) -> None:
        self._participants = participants
        self._wiring = wiring
        self._degree = DEGREES[extrapolation]
        self._any_continuous = any(
            term.continuous for p in participants for term in wiring.terms_of(p)
        )
        require_variable_steps(
            (p for p in participants if self._is_halved(p)),
            "extrapolation",
            f'"{extrapolation}"',
            '"constant" or "linear"',
        )
        self._step = 0.0
        self._points: list[tuple[float, Outputs]] = []

    def begin(self, step: float) -> None:
        """Look at all outputs, at the start of a step of this length, s."""
        outputs = {p.name: dict(p.read()) for p in self._participants}
        older = self._points[max(0, len(self._points) - self._degree) :]
        self._points = [*older, (self._step, outputs)]
        self._step = step

    @property
    def start(self) -> Outputs:
        """All outputs at the start of the step."""
        return self._points[-1][1]

    @property
    def short_of_points(self) -> bool:
        """Whether a parabola has one point only, so that its order would be lost."""
        return self._degree > 1 and len(self._points) == 1 and self._any_continuous

    def move(
        self, participant: Participant, parts: Sequence[Mapping[str, float]], time: float
    ) -> None:
        """Carry a participant over the step, holding one set of inputs after the other."""
        share = self._step / len(parts)
        for index, values in enumerate(parts):
            participant.write(values)
            participant.step(time + index * share, share)

    def held(
        self, participant: Participant, ends: Outputs, guessed: Outputs | None = None
    ) -> list[dict[str, float]]:
        """Inputs to hold over each of the equal parts of the step.

        Parameters
        ----------
        participant : Participant
            Whose inputs.
        ends : mapping
            Outputs at the end of the step, as far as they are known.
        guessed : mapping, optional
            Ends of further outputs, for those that are continuous.
        """
        parts = 2 if self._is_halved(participant) else 1
        values = [partial(self._value, ends, guessed or {}, parts, part) for part in range(parts)]
        return [self._wiring.inputs_of(participant, value) for value in values]

    def _is_halved(self, participant: Participant) -> bool:
        return self._degree > 1 and any(
            term.continuous for term in self._wiring.terms_of(participant)
        )

    def _value(self, ends: Outputs, guessed: Outputs, parts: int, part: int, term: Term) -> float:
        name, output = term.source.name, term.output
        end = ends.get(name, {}).get(output)
        if end is None and term.continuous:
            end = guessed.get(name, {}).get(output)
        if not term.continuous or self._degree == 0:
            return self.start[name][output] if end is None else end
        places, values = [], []
        if end is not None:
            places, values = [1.0], [end]
        place = 0.0
        for length, outputs in reversed(self._points):
            if len(places) > self._degree:
                break
            places.append(place)
            values.append(outputs[name][output])
            place -= length / self._step
        weights = held_weights(tuple(places), parts)[part]
        return sum(weight * value for weight, value in zip(weights, values, strict=True))

    def get_state(self) -> Any:
        """Points and the length of the last step, as plain lists and dicts."""
        return [self._step, [[length, outputs] for length, outputs in self._points]]

    def set_state(self, state: Any) -> None:
        """Go back to what `get_state` gave."""
        self._step, points = state
        self._points = [(length, outputs) for length, outputs in points]

    def forget(self) -> None:
        """Forget all points: what comes next does not continue them."""
        self._step, self._points = 0.0, []


@lru_cache(maxsize=256)
def held_weights(places: tuple[float, ...], parts: int) -> tuple[tuple[float, ...], ...]:
    """Weights of a polynomial's values in what is held over each part of the step from 0 to 1.

    Parameters
    ----------
    places : tuple of float
        Where the values are taken, in steps from the start.
    parts : int
        1 keeps the mean over the step; 2 keeps the mean and the first moment.

    Returns
    -------
    tuple of tuple of float
        For each part, a weight for each place.
    """
    # Weights are exact for each power of s that the number of values determines.
    powers = np.arange(len(places))
    vandermonde = np.vander(places, increasing=True).T
    mean = np.linalg.solve(vandermonde, 1 / (powers + 1))
    if parts == 1:
        return (tuple(mean.tolist()),)
    # With a and b over the halves, the first moment about the middle is (b − a)/8.
    moment = np.linalg.solve(vandermonde, 1 / (powers + 2) - 1 / (2 * powers + 2))
    return tuple((mean - 4 * moment).tolist()), tuple((mean + 4 * moment).tolist())
