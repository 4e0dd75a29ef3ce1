"""Saving and restoring a soft body as a participant: exact, also through bytes."""

from __future__ import annotations

import pickle
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import scenarios
from cosim import SoftBodyParticipant
from scenarios.running.assemble import build_body
from softbody_core import INTEGRATORS, ParameterError, SoftBody

Twin = Callable[[], SoftBodyParticipant]


def twins(method: str) -> Twin:
    scene = scenarios.load("sphere-lung", {"mesh.icosphere": 1, "integrator": {"method": method}})
    return lambda: SoftBodyParticipant(build_body(scene))


def onward(body: SoftBodyParticipant, first: int) -> list[object]:
    """What a body does from one step on, and where its points end."""
    outputs: list[object] = []
    for i in range(first, first + 4):
        body.write({"delta_p": 200.0 * i})
        body.step(i / 120, 1 / 120)
        outputs.append(dict(body.read()))
    return [
        *outputs,
        body.body.positions.tobytes(),
        body.body.velocities.tobytes(),
        body.body.counters,
    ]


@pytest.mark.parametrize("method", INTEGRATORS)
def test_what_follows_a_saved_state_repeats_to_the_bit(method: str) -> None:
    twin = twins(method)
    body = twin()
    assert body.can_get_and_set_state
    assert body.can_serialize_state
    body.write({"n": 40_000.0})
    onward(body, 0)
    saved, dumped, outputs = body.get_state(), body.serialize(), dict(body.read())
    expected = onward(body, 4)
    for _ in range(2):  # as often as need be
        body.set_state(saved)
        assert body.read() == outputs
        assert onward(body, 4) == expected
    body.free_state(saved)
    other = twin()  # as in another process
    other.deserialize(dumped)
    assert other.read() == outputs
    assert onward(other, 4) == expected


def test_a_state_of_another_body_is_refused() -> None:
    body = twins("sdirk2")()
    other = SoftBodyParticipant(build_body(scenarios.load("sphere-lung", {"mesh.icosphere": 2})))
    with pytest.raises(ParameterError, match="162 points, this one has 42"):
        body.deserialize(other.serialize())


def test_a_damaged_state_is_refused() -> None:
    body = twins("sdirk2")()
    for damaged in (body.serialize()[:-40], b"no pickle at all"):
        with pytest.raises(ParameterError, match="cannot be read"):
            body.deserialize(damaged)


class Harm:
    """Pickles as a call of whatever it is given."""

    def __init__(self, *call: object) -> None:
        self._call = call

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        function, *arguments = self._call
        return function, tuple(arguments)


def calling(module: str, name: str) -> bytes:
    """A pickle that calls something by name, without arguments."""
    names = (b"\x8c" + bytes([len(text)]) + text.encode() for text in (module, name))
    return b"\x80\x04" + b"".join(names) + b"\x93)R."


def test_a_file_calls_nothing(tmp_path: Path) -> None:
    body = twins("sdirk2")()
    mark = tmp_path / "mark"
    for harm in (
        Harm(subprocess.check_call, ["touch", str(mark)]),
        Harm(np.save, str(mark), [1.0]),
        Harm(SoftBody.__init__),
    ):
        with pytest.raises(ParameterError, match="it names"):
            body.deserialize(pickle.dumps(harm))
    for name in ("np.memmap", "np.save", "SoftBody.step"):
        with pytest.raises(ParameterError, match=f"it names softbody_core.body.{name}"):
            body.deserialize(calling("softbody_core.body", name))
    assert list(tmp_path.iterdir()) == []
