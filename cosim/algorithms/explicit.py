"""What Gauss-Seidel and Jacobi share: each step is taken once, and nobody goes back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cosim.algorithms.algorithm import Algorithm, Coupler
from cosim.algorithms.rollback import Rollback, can_roll_back
from cosim.algorithms.signals import DEGREES, Extrapolation, Outputs, Signals
from cosim.connection import Wiring
from cosim.participant import Participant


@dataclass(frozen=True)
class Explicit(Algorithm):
    """Gauss-Seidel or Jacobi.

    Parameters
    ----------
    extrapolation : str
        How continuous outputs go on over a step: "constant", "linear" or "quadratic".
    """

    extrapolation: Extrapolation = "constant"

    @property
    def order(self) -> int:
        """One more than the degree of the extrapolation."""
        return DEGREES[self.extrapolation] + 1

    def bind(self, participants: Sequence[Participant], wiring: Wiring) -> Coupler:
        """Get ready to carry these participants."""
        if self.extrapolation == "constant":
            return Holding(participants, wiring, in_turn=self.in_turn)
        return Extrapolating(participants, wiring, self.extrapolation, in_turn=self.in_turn)


class Holding(Coupler):
    """Steps everyone once, under inputs that are held: nothing to remember, and little to do.

    Parameters
    ----------
    participants, wiring
        As of `Algorithm.bind`.
    in_turn : bool
        Each sees the end of those before it; otherwise nobody does.
    """

    def __init__(
        self, participants: Sequence[Participant], wiring: Wiring, *, in_turn: bool
    ) -> None:
        self._participants, self._wiring, self._in_turn = participants, wiring, in_turn

    def advance(self, time: float, step: float) -> None:
        """Carry everyone over a communication step."""
        if self._in_turn:
            for participant in self._participants:
                participant.write(self._wiring.inputs_of(participant))
                participant.step(time, step)
        else:
            inputs = [self._wiring.inputs_of(participant) for participant in self._participants]
            for participant, values in zip(self._participants, inputs, strict=True):
                participant.write(values)
                participant.step(time, step)


class Extrapolating(Coupler):
    """Steps everyone once, under inputs that go on as they came.

    A parabola has too few points in the first step, and after a jump. That step is taken twice
    where everyone can be rolled back, the second time with the ends that the first one found;
    otherwise it is taken once, and its error is of second order.

    Parameters
    ----------
    participants, wiring
        As of `Algorithm.bind`.
    extrapolation : str
        As of `Signals`.
    in_turn : bool
        Each sees the end of those before it; otherwise nobody does.
    """

    def __init__(
        self,
        participants: Sequence[Participant],
        wiring: Wiring,
        extrapolation: Extrapolation,
        *,
        in_turn: bool,
    ) -> None:
        self._participants = participants
        self._signals = Signals(participants, wiring, extrapolation)
        self._in_turn = in_turn

    def advance(self, time: float, step: float) -> None:
        """Carry everyone over a communication step."""
        self._signals.begin(step)
        guessed: Outputs = {}
        if self._signals.short_of_points and can_roll_back(self._participants):
            start = Rollback(self._participants)
            self._sweep(time, guessed)
            guessed = {p.name: dict(p.read()) for p in self._participants}
            start.set_states()
            start.free_states()
        self._sweep(time, guessed)

    def _sweep(self, time: float, guessed: Outputs) -> None:
        ends: dict[str, Mapping[str, float]] = {}
        for participant in self._participants:
            held = self._signals.held(participant, ends, guessed)
            self._signals.move(participant, held, time)
            if self._in_turn:
                ends[participant.name] = participant.read()

    def get_state(self) -> Any:
        """Outputs at the last points."""
        return self._signals.get_state()

    def set_state(self, state: Any) -> None:
        """Go back to what `get_state` gave."""
        self._signals.set_state(state)

    def restart(self) -> None:
        """Forget what came before a jump."""
        self._signals.forget()
