"""FMUs in a process of their own: real processes, real crashes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from cosim import FmuCrashError, FmuError, FmuParticipant, FmuStepError, FmuTimeoutError
from cosim.fmu.isolation import IsolatedFmu
from tests.cosim.foreign import STATES

Foreign = Callable[..., Path]
Start = Callable[..., IsolatedFmu]

LIMIT = 1.0
"""For a call, s: no call here takes a hundredth of it, and starting a process has its own limit."""


@pytest.fixture
def start() -> Iterator[Start]:
    """Start an FMU in its process, up to the first step, and close it after the test."""
    opened = []

    def started(path: Path, **options: Any) -> IsolatedFmu:
        fmu = IsolatedFmu(path, time_limit=LIMIT, **options)
        opened.append(fmu)
        fmu.initialize(0.0)
        fmu.begin()
        return fmu

    yield started
    for fmu in opened:
        fmu.close()


def process_of(fmu: IsolatedFmu) -> int:
    return int(fmu._process._process.pid)


def is_alive(process: int) -> bool:
    """Whether a process is there; one that nobody has waited for yet is not."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def gone_within(process: int, seconds: float) -> bool:
    deadline = time.monotonic() + seconds
    while is_alive(process) and time.monotonic() < deadline:
        time.sleep(0.05)
    return not is_alive(process)


def test_an_isolated_fmu_gives_the_same_to_the_bit(
    foreign: Foreign, start: Start, temporary: Path
) -> None:
    path = foreign(3, "WARN", ports="typed", flags=STATES)
    direct = FmuParticipant(path, parameters={"gain": 0.3})
    direct.initialize(0.0)
    direct.begin()
    isolated = start(path, parameters={"gain": 0.3})
    assert isolated.ports == direct.ports
    assert (isolated.can_get_and_set_state, isolated.can_serialize_state, isolated.sha256) == (
        True,
        True,
        direct.sha256,
    )

    def onward(fmu: FmuParticipant, first: int) -> list[dict[str, float]]:
        outputs = []
        for i in range(first, first + 5):
            fmu.write({"volume": 0.1 * i, "stride": i})
            fmu.step(i * 0.1, 0.1)
            outputs.append(dict(fmu.read()))
        return outputs

    assert onward(isolated, 0) == onward(direct, 0)
    saved, dumped = isolated.get_state(), isolated.serialize()
    assert dumped == direct.serialize()
    expected = onward(direct, 5)
    assert onward(isolated, 5) == expected
    isolated.set_state(saved)
    assert onward(isolated, 5) == expected
    isolated.free_state(saved)
    isolated.deserialize(dumped)
    assert onward(isolated, 5) == expected
    with pytest.raises(FmuError, match="the value is out of the range") as caught:
        onward(isolated, 300)  # more than the FMU's eight bits hold
    assert "could not take {'volume': 30.0, 'stride': 300}" in str(caught.value)
    assert "  [warning] the filter is due (20 times)" in str(caught.value)
    assert isolated.log.warnings == ["the filter is due"]
    process = process_of(isolated)
    assert is_alive(process)
    isolated.close()
    isolated.close()  # may be called twice
    assert not is_alive(process)
    direct.close()
    assert list(temporary.iterdir()) == []


def test_a_crash_is_an_error_that_names_it(foreign: Foreign, start: Start, temporary: Path) -> None:
    path = foreign(2, "CRASH")
    fmu = start(path)
    fmu.step(0.0, 0.1)
    before, process = dict(fmu.read()), process_of(fmu)
    with pytest.raises(FmuCrashError, match=r"SIGSEGV \(segmentation fault\)") as caught:
        fmu.step(0.1, 0.1)
    assert f"FMU {path} crashed when it was to step from t = 0.1 s by 0.1 s" in str(caught.value)
    assert fmu.read() == before
    with pytest.raises(FmuCrashError):  # and so does whoever asks again
        fmu.step(0.1, 0.1)
    fmu.close()
    assert not is_alive(process)
    assert list(temporary.iterdir()) == []  # though the process could not remove its own


def test_a_hang_is_stopped_at_its_time_limit(foreign: Foreign, start: Start) -> None:
    fmu = start(foreign(2, "HANG"))
    process, begun = process_of(fmu), time.monotonic()
    with pytest.raises(FmuTimeoutError, match=r"t = 0\.1 s by 0\.1 s and gave no answer within 1"):
        fmu.step(0.1, 0.1)
    # the watch looks every 50 ms; the rest is for a busy machine
    assert LIMIT <= time.monotonic() - begun < LIMIT + 2.0
    assert not is_alive(process)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "kind", "message"),
    [
        ("LOAD_CRASH", FmuCrashError, "it was to be loaded and initialized: its process ended"),
        ("LOAD_HANG", FmuTimeoutError, "was to be loaded and initialized and gave no answer"),
        ("ABORT", FmuCrashError, r"SIGABRT .*\n  \[error\] the shaft is broken at t = 0 s"),
        ("QUIT", FmuCrashError, "its process ended with exit code 7"),
        ("NO_INSTANCE", FmuError, "makes no instance for the GUID"),
        ("STATUS=2", FmuStepError, "refused the step"),
    ],
)
def test_every_fault_in_a_process_ends_as_an_error(
    foreign: Foreign, start: Start, fault: str, kind: type[FmuError], message: str
) -> None:
    with pytest.raises(kind, match=message):
        start(foreign(2, fault)).step(0.1, 0.1)


@pytest.mark.slow
def test_a_python_fmu_runs_isolated(paper: Path, start: Start) -> None:
    fmu = start(paper, parameters={"frames": 60, "literal_swing": True, "law": "open"})
    fmu.step(0.0, 1 / 15)
    assert fmu.read()["delta_p"] == 40.0 / 60


@pytest.mark.slow
def test_a_second_run_needs_a_new_participant(foreign: Foreign, start: Start) -> None:
    with pytest.raises(FmuError, match="already running"):
        start(foreign(2)).initialize(0.0)


OPEN_AND_HANG = """
import sys
from cosim.fmu.isolation import IsolatedFmu

fmu = IsolatedFmu(sys.argv[1], time_limit=600)
fmu.initialize(0.0)
fmu.begin()
print(fmu._process._process.pid, flush=True)
fmu.step(0.1, 0.1)
"""


@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_process_stays_behind_a_parent_that_goes(
    foreign: Foreign, tmp_path: Path, sent: signal.Signals
) -> None:
    parent = subprocess.Popen(
        [sys.executable, "-c", OPEN_AND_HANG, str(foreign(2, "HANG"))],
        env={**os.environ, "TMPDIR": str(tmp_path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert parent.stdout is not None
    assert parent.stderr is not None
    child = int(parent.stdout.readline())
    assert parent.stderr.readline() == "hangs\n"  # the FMU says so
    assert is_alive(child)
    parent.send_signal(sent)
    parent.communicate(timeout=30)
    assert gone_within(child, 10.0)  # it looks every second
