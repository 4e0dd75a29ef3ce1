"""A communication step that is divided as the error of the coupling asks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from cosim.algorithms.algorithm import Algorithm, Coupler
from cosim.algorithms.dividing import Dividing, Method, algorithm_of
from cosim.algorithms.rollback import Rollback
from cosim.algorithms.scale import Scale
from cosim.algorithms.signals import Extrapolation
from cosim.connection import Wiring
from cosim.errors import CouplingError
from cosim.participant import Participant, Variability
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Quantity


@dataclass(frozen=True)
class Adaptive(Dividing):
    """Each communication step in equal halves, quarters, eighths …, as far as they are needed.

    A part is taken once as a whole and once in two halves. The halves are kept if their estimated
    error, |whole − halves| / (2^order − 1), is small enough (step doubling: Hairer, Nørsett &
    Wanner 1993, II.4). Communication points stay where they are, whatever lies between.

    Parameters
    ----------
    tolerance : float
        Largest estimated error of a connected continuous output in one part, as a share of the
        largest size so far of outputs that measure the same, 1.
    method : str
        Who takes the parts: "gauss-seidel", "jacobi" or "iterated".
    extrapolation : str
        As of that algorithm.
    most_halvings : int
        How often a communication step may be halved.
    """

    name: ClassVar[str] = "adaptive"
    least_parts: ClassVar[int] = 2

    tolerance: Annotated[float, Quantity("1", above=0)] = 1e-3
    method: Method = "gauss-seidel"
    extrapolation: Extrapolation = "constant"
    most_halvings: Annotated[int, Quantity("1", at_least=1, below=31)] = 12

    @property
    def inner(self) -> Algorithm:
        """Who takes the parts."""
        return algorithm_of(self.method, self.extrapolation)

    def bind(self, participants: Sequence[Participant], wiring: Wiring) -> Coupler:
        """Get ready to carry these participants."""
        self.check(participants)
        return _StepDoubling(self, participants, wiring)


class _StepDoubling(Coupler):
    def __init__(
        self, method: Adaptive, participants: Sequence[Participant], wiring: Wiring
    ) -> None:
        self._method = method
        self._participants = participants
        self._inner = method.inner.bind(participants, wiring)
        self._watched = _connected(participants, wiring)
        self._scale = Scale([owner.ports[output] for owner, output in self._watched])
        self._halvings = 0

    def advance(self, time: float, step: float) -> None:
        """Carry everyone over a communication step."""
        finest = 2**self._method.most_halvings
        gain = 2.0**self._method.order
        done = 0
        while done < finest:
            size = finest >> self._halvings
            part = step * (size / finest)
            start = time + step * (done / finest)
            error = self._try(start, part) / (gain - 1)
            if error <= self._method.tolerance:
                done += size
                # Twice as long a part errs by 2^(order + 1) as much, and begins at its multiples.
                longer_fits = self._halvings > 0 and done % (2 * size) == 0
                if longer_fits and 2 * gain * error <= self._method.tolerance:
                    self._halvings -= 1
            elif self._halvings + 1 < self._method.most_halvings:
                self._halvings += 1
            else:
                raise CouplingError(
                    f"algorithm adaptive: at t = {start:.6g} s a part of {part:.3g} s "
                    f"errs by {error:.2g}, and at most {self._method.tolerance:.2g} is allowed. "
                    "Raise tolerance, or most_halvings if the error does shrink",
                    settings=["algorithm", "tolerance", "most_halvings"],
                )

    def _try(self, time: float, part: float) -> float:
        """Take a part, and leave everyone at its end, or at its start if it errs too much."""
        gain = 2.0**self._method.order
        before, state = Rollback(self._participants), self._inner.get_state()
        self._inner.advance(time, part)
        whole = self._look()
        before.set_states()
        self._inner.set_state(state)
        self._inner.advance(time, part / 2)
        self._inner.advance(time + part / 2, part / 2)
        halves = self._look()
        error = float(np.max(np.abs(whole - halves) / self._scale.update(halves), initial=0.0))
        if error > self._method.tolerance * (gain - 1):
            before.set_states()
            self._inner.set_state(state)
        before.free_states()
        return error

    def _look(self) -> Floats:
        return np.array([owner.read()[output] for owner, output in self._watched], float)

    def get_state(self) -> Any:
        """Length of the parts, sizes of the outputs, and what the method remembers."""
        return [self._halvings, self._scale.get_state(), self._inner.get_state()]

    def set_state(self, state: Any) -> None:
        """Go back to what `get_state` gave."""
        self._halvings, scale, method = state
        self._scale.set_state(scale)
        self._inner.set_state(method)

    def restart(self) -> None:
        """Forget what came before a jump."""
        self._inner.restart()


def _connected(
    participants: Sequence[Participant], wiring: Wiring
) -> list[tuple[Participant, str]]:
    """Continuous outputs that someone takes. Others jump, and a jump does not shrink."""
    outputs = {
        (term.source.name, term.output): (term.source, term.output)
        for participant in participants
        for term in wiring.terms_of(participant)
        if term.source.ports[term.output].variability is Variability.CONTINUOUS
    }
    return list(outputs.values())
