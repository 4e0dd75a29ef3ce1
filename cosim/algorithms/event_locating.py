"""Events inside a communication step, found by bisection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from cosim.algorithms.algorithm import Algorithm, Coupler
from cosim.algorithms.dividing import Dividing, Method, algorithm_of
from cosim.algorithms.rollback import Rollback
from cosim.algorithms.signals import Extrapolation
from cosim.connection import Wiring
from cosim.errors import CouplingError
from cosim.participant import Causality, Participant, Variability
from softbody_core.ground.parameters import Quantity

Modes = dict[str, list[float]]


@dataclass(frozen=True)
class EventLocating(Dividing):
    """A communication point is put where a mode changes: a valve opens, a breath begins.

    A mode is an integer or boolean output. Some participants decide on it at the start of a step,
    others within it. So the mode at a moment is what is seen after one more step of the length
    `tolerance`, taken by those with modes alone and then taken back. If the modes at the two ends
    of a step differ, the moment of the change is bracketed by bisection, and the step is divided
    there. Two changes that undo each other within one step are not seen.

    A controller that acts at frames switches at a frame, and at no other moment: there a located
    event is the frame itself.

    Parameters
    ----------
    tolerance : float
        Length of the bracket, s.
    method : str
        Who takes the steps: "gauss-seidel", "jacobi" or "iterated".
    extrapolation : str
        As of that algorithm. After an event it starts afresh.
    most_events : int
        How many a communication step may have.
    """

    name: ClassVar[str] = "event-locating"

    tolerance: Annotated[float, Quantity("s", above=0)] = 1e-4
    method: Method = "gauss-seidel"
    extrapolation: Extrapolation = "constant"
    most_events: Annotated[int, Quantity("1", at_least=1)] = 10

    @property
    def inner(self) -> Algorithm:
        """Who takes the steps between events."""
        return algorithm_of(self.method, self.extrapolation)

    def bind(self, participants: Sequence[Participant], wiring: Wiring) -> Coupler:
        """Get ready to carry these participants."""
        self.check(participants)
        return _Bisection(self, participants, wiring)


class _Bisection(Coupler):
    def __init__(
        self, method: EventLocating, participants: Sequence[Participant], wiring: Wiring
    ) -> None:
        self._method = method
        self._participants = participants
        self._wiring = wiring
        self._inner = method.inner.bind(participants, wiring)
        self._deciding = [(p, names) for p in participants if (names := _mode_ports(p))]
        if not self._deciding:
            raise CouplingError(
                "algorithm event-locating: nothing has an integer or boolean output, so "
                "there is no event to locate; take another algorithm",
                settings=["algorithm"],
            )

    def advance(self, time: float, step: float) -> None:
        """Carry everyone over a communication step."""
        done = 0.0
        for _ in range(self._method.most_events + 1):
            done = self._advance_to_event(time, done, step)
            if done == step:
                return
        raise CouplingError(
            f"more than {self._method.most_events} events from t = {time:.6g} s by {step:.6g} s: "
            "is something chattering? Raise most_events, or take another algorithm",
            settings=["most_events"],
        )

    def _advance_to_event(self, time: float, done: float, step: float) -> float:
        """Go on from `done` to just behind the next event, or to the end; say where that is, s."""
        start, state = Rollback(self._participants), self._inner.get_state()
        before = self._modes(time + done)
        low, high = done, step

        def go_to(moment: float) -> None:
            start.set_states()
            self._inner.set_state(state)
            if moment > done:
                self._inner.advance(time + done, moment - done)

        go_to(step)
        unseen = self._read() == before
        if self._modes(time + step) == before:
            start.free_states()
            return step
        while high - low > self._method.tolerance:
            middle = (low + high) / 2
            go_to(middle)
            if self._modes(time + middle) == before:
                low = middle
            else:
                high = middle
        if unseen and step - high <= self._method.tolerance:
            # At the very end: whoever looks ahead sees it, and the step itself does not.
            low, high = step, step
        go_to(low)
        if high > low:
            self._inner.advance(time + low, high - low)
        if high < step and self._read() == before:
            # So far it was looked ahead to. Once it shows, those who see it late see it now.
            low, high = high, min(high + self._method.tolerance, step)
            self._inner.advance(time + low, high - low)
        start.free_states()
        self._inner.restart()
        return high

    def _modes(self, time: float) -> Modes:
        """Modes at this moment: what a short step from here shows, which is then taken back."""
        start = Rollback([participant for participant, _ in self._deciding])
        for participant, _ in self._deciding:
            participant.write(self._wiring.inputs_of(participant))
            participant.step(time, self._method.tolerance)
        modes = self._read()
        start.set_states()
        start.free_states()
        return modes

    def _read(self) -> Modes:
        return {p.name: [p.read()[name] for name in names] for p, names in self._deciding}

    def get_state(self) -> Any:
        """What the method remembers."""
        return self._inner.get_state()

    def set_state(self, state: Any) -> None:
        """Go back to what `get_state` gave."""
        self._inner.set_state(state)

    def restart(self) -> None:
        """Forget what came before a jump."""
        self._inner.restart()


def _mode_ports(participant: Participant) -> list[str]:
    return [
        port.name
        for port in participant.ports.values()
        if port.causality is Causality.OUTPUT and port.variability is Variability.MODE
    ]
