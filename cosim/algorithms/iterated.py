"""Iterated (implicit) coupling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from cosim.algorithms.algorithm import Algorithm, Coupler
from cosim.algorithms.relaxation import Relaxation, relaxing
from cosim.algorithms.rollback import Rollback
from cosim.algorithms.scale import Scale
from cosim.algorithms.signals import DEGREES, Extrapolation, Outputs, Signals
from cosim.connection import Wiring, is_sampled
from cosim.errors import CouplingError
from cosim.participant import Participant
from softbody_core.ground.arrays import Floats
from softbody_core.ground.parameters import Quantity


@dataclass(frozen=True)
class Iterated(Algorithm):
    """Each step is repeated until what everyone assumed of the others is what they gave.

    Participants go in turn, so only connections that point back are iterated. A sampled participant
    takes what it needs from the start of the step: a sampled controller that goes first leaves
    nothing to iterate, and the step is taken once.

    Parameters
    ----------
    tolerance : float
        Largest change of an output in the last pass, as a share of the largest size so far of
        outputs that measure the same, 1.
    max_iterations : int
        Passes after which a step has failed.
    relaxation : str
        "none", "aitken" or "quasi-newton".
    extrapolation : str
        How continuous outputs run over a step to the end that is iterated: "constant" (at their
        end), "linear" or "quadratic".
    """

    name: ClassVar[str] = "iterated"
    goes_back: ClassVar[bool] = True  # where something is left to iterate

    tolerance: Annotated[float, Quantity("1", above=0)] = 1e-8
    max_iterations: Annotated[int, Quantity("1", at_least=2)] = 25
    relaxation: Relaxation = "quasi-newton"
    extrapolation: Extrapolation = "linear"

    @property
    def order(self) -> int:
        """One more than the degree of the polynomial."""
        return DEGREES[self.extrapolation] + 1

    def bind(self, participants: Sequence[Participant], wiring: Wiring) -> Coupler:
        """Get ready to carry these participants."""
        return _Iteration(self, participants, wiring)


class _Iteration(Coupler):
    def __init__(
        self, method: Iterated, participants: Sequence[Participant], wiring: Wiring
    ) -> None:
        self._method = method
        self._participants = participants
        self._signals = Signals(participants, wiring, method.extrapolation)
        self._unknowns = _pointing_back(participants, wiring)
        ports = {participant.name: participant.ports for participant in participants}
        self._scale = Scale([ports[name][output] for name, output in self._unknowns])
        if self._unknowns:
            method.check(participants)

    def advance(self, time: float, step: float) -> None:
        """Carry everyone over a communication step."""
        self._signals.begin(step)
        if not self._unknowns:
            self._sweep(time, {})
            return
        start = Rollback(self._participants)
        guess, sizes = self._vector(self._signals.start), None
        relaxation = relaxing(self._method.relaxation)
        for _ in range(self._method.max_iterations):
            self._sweep(time, self._outputs(guess))
            ends = self._vector({p.name: p.read() for p in self._participants})
            if sizes is None:  # the same in all passes, or the relaxation would be misled
                sizes = self._scale.update(ends)
            change = (ends - guess) / sizes
            if np.abs(change).max() <= self._method.tolerance:
                start.free_states()
                return
            guess = sizes * relaxation.next(guess / sizes, change)
            start.set_states()
        start.free_states()
        worst = int(np.abs(change).argmax())
        raise CouplingError(
            f"the iteration from t = {time:.6g} s by {step:.6g} s did not converge: after "
            f"{self._method.max_iterations} passes {'.'.join(self._unknowns[worst])} still changes "
            f"by {abs(change[worst]):.2g} of its size; the tolerance is "
            f"{self._method.tolerance:.2g}. Try a shorter communication step, more "
            'max_iterations, or relaxation = "quasi-newton"',
            settings=["communication step", "max_iterations"],
        )

    def _sweep(self, time: float, ends: Outputs) -> None:
        known = dict(ends)
        for participant in self._participants:
            needed = {} if is_sampled(participant) else known
            self._signals.move(participant, self._signals.held(participant, needed), time)
            known[participant.name] = participant.read()

    def _vector(self, outputs: Outputs) -> Floats:
        return np.array([outputs[name][output] for name, output in self._unknowns])

    def _outputs(self, vector: Floats) -> Outputs:
        ends: dict[str, dict[str, float]] = {}
        for (name, output), value in zip(self._unknowns, vector.tolist(), strict=True):
            ends.setdefault(name, {})[output] = value
        return ends

    def get_state(self) -> Any:
        """Outputs at the last points, and how large they were."""
        return [self._signals.get_state(), self._scale.get_state()]

    def set_state(self, state: Any) -> None:
        """Go back to what `get_state` gave."""
        signals, scale = state
        self._signals.set_state(signals)
        self._scale.set_state(scale)

    def restart(self) -> None:
        """Forget what came before a jump."""
        self._signals.forget()


def _pointing_back(participants: Sequence[Participant], wiring: Wiring) -> list[tuple[str, str]]:
    """Outputs that someone needs who does not step later, without those that are only sampled."""
    unknown: dict[tuple[str, str], None] = {}
    stepped: set[str] = set()
    for participant in participants:
        if not is_sampled(participant):
            for term in wiring.terms_of(participant):
                if term.source.name not in stepped:
                    unknown[term.source.name, term.output] = None
        stepped.add(participant.name)
    return list(unknown)
