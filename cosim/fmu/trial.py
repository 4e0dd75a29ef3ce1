"""A short run of an FMU in a process of its own: whether it starts, steps, and gives numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from cosim.errors import FmuError
from cosim.fmu.findings import Finding, message_of
from cosim.fmu.isolation import TIME_LIMIT, IsolatedFmu

STEPS: Final = 30


def try_fmu(
    path: Path, inputs: Mapping[str, float], step: float, time_limit: float = TIME_LIMIT
) -> Iterator[Finding]:
    """Let an FMU take some steps, and find what goes wrong.

    The binary itself knows its GUID, and so says here if the description has another.

    Parameters
    ----------
    path : Path
        An FMU that can be described.
    inputs : mapping
        Constant values for its inputs, in its own units.
    step : float
        Communication step, s.
    time_limit : float
        Longest time that it may take for one call, s.

    Yields
    ------
    Finding
        Faults: it does not start, fails, hangs, crashes, or gives what is no number. Notes: a
        saved state does not repeat.
    """
    try:
        fmu = IsolatedFmu(path, time_limit=time_limit)
    except FmuError as error:
        yield Finding.of(path, error)
        return
    try:
        fmu.initialize(0.0)
        fmu.write(inputs)
        fmu.begin()
        time = 0.0
        for index in range(STEPS):
            bad = sorted(name for name, value in fmu.read().items() if not math.isfinite(value))
            if bad:
                yield Finding(
                    f"{', '.join(bad)} = {fmu.read()[bad[0]]} at t = {time:.4g} s of a trial; "
                    "whoever takes that needs numbers",
                    fault=True,
                )
                return
            fmu.write(inputs)
            fmu.step(time, step)
            time = (index + 1) * step
        yield from _repeats(fmu, time, step)
    except FmuError as error:
        yield Finding(f"in a trial: {message_of(path, error)}", fault=True)
    finally:
        fmu.close()


def _repeats(fmu: IsolatedFmu, time: float, step: float) -> Iterator[Finding]:
    """Go back by what the FMU says it can do, and see whether it goes on as before."""
    ways: list[tuple[bool, str, Callable[[], Any], Callable[[Any], None]]] = [
        (fmu.can_get_and_set_state, "saved", fmu.get_state, fmu.set_state),
        (fmu.can_serialize_state, "serialized", fmu.serialize, fmu.deserialize),
    ]
    for claimed, word, get, set_ in ways:
        if not claimed:
            continue
        try:
            state = get()
            fmu.step(time, step)
            onward = dict(fmu.read())
            set_(state)
            fmu.step(time, step)
            if dict(fmu.read()) != onward:
                yield Finding(f"says that its state can be {word}, but does not go on as before")
            set_(state)
        except FmuError as error:
            yield Finding(f"says that its state can be {word}, but {message_of(fmu.path, error)}")
