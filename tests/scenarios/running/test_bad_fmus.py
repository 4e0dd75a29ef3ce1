"""What a user sees of a bad FMU: the whole message, the exit code, and the data so far."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
import xarray as xr

from tests.cosim.foreign import GUID
from tests.scenarios.conftest import Cli

Foreign = Callable[..., Path]

PAGE = Path(__file__).parents[3] / "docs" / "foreign-fmus.md"
FAST = ("--set", "mesh.icosphere=1", "--cycles", "1", "--no-plot")
ISOLATED = ("--set", "controller.isolation=process", "--set", "controller.time_limit=1 s")

NO_INSTANCE = (
    f"could not be loaded: it makes no instance for the GUID '{GUID}' of its modelDescription.xml. "
    "Its binary may be of another export, or miss something that it needs; export it again."
)
NO_FUNCTION = (
    "Its binary has to hold every function of FMI {0}.0 and find the libraries that it uses; "
    "export it again, with its libraries linked in. It logged nothing."
)
STEP = "step from t = 0.1 s by 0.0333333 s"
STOPPED = "It logged: [{0}] the pump has stopped at t = 0.1 s"
REFUSED = (
    f"refused the step (status discard) {STEP[5:]}; it came to t = 0.1 s. Try a shorter "
    "communication step (coupling.step). "
)
FAULT = "The fault is in the FMU; ask who exported it. It logged nothing."


@dataclass(frozen=True)
class Bad:
    """An FMU that is bad: how it is made, and what comes of it."""

    version: int
    defines: tuple[str, ...]
    code: int
    said: str
    flags: str = 'canHandleVariableCommunicationStepSize="true"'
    experiment: str = ""


HERE = {
    "wrong GUID": Bad(
        2, ('TOKEN="other"',), 2, f"{NO_INSTANCE} It logged: [error] unknown GUID {GUID}"
    ),
    "wrong token, FMI 3.0": Bad(
        3,
        ('TOKEN="other"',),
        2,
        f"{NO_INSTANCE} It logged: [error] unknown instantiation token",
    ),
    "missing function": Bad(
        2,
        ("NO_STEP",),
        2,
        "could not be loaded: binaries/linux64/Foreign.so: undefined symbol: fmi2DoStep. "
        + NO_FUNCTION.format(2),
    ),
    "error in initialization": Bad(
        2,
        ("INIT_STATUS=3",),
        2,
        "could not leave initialization: fmi2ExitInitializationMode answered with status 3 "
        "(error). It logged: [error] the valve is shut at t = 0 s",
    ),
    "error in a step": Bad(
        2,
        ("STATUS=3",),
        3,
        f"could not {STEP}: fmi2DoStep answered with status 3 (error). {STOPPED.format('error')}",
    ),
    "error in a step, FMI 1.0": Bad(
        1,
        ("STATUS=3",),
        3,
        f"could not {STEP}: fmi1DoStep answered with status 3 (error). {STOPPED.format('error')}",
    ),
    "fatal error in a step": Bad(
        2,
        ("STATUS=4",),
        3,
        f"could not {STEP}: fmi2DoStep answered with status 4 (fatal). {STOPPED.format('fatal')}",
    ),
    "step discarded": Bad(2, ("STATUS=2",), 3, REFUSED + STOPPED.format("discard")),
    "no progress, FMI 3.0": Bad(
        3,
        ("EARLY=0",),
        3,
        "did not move on in the step from t = 0 s by 0.0333333 s; it came to t = 0 s. Try a "
        "shorter communication step (coupling.step). It logged nothing.",
    ),
    "asks to end": Bad(
        2,
        ("TERMINATE",),
        3,
        "asked to end the simulation at t = 0.133333 s. It logged nothing.",
    ),
    "another fixed step": Bad(
        2,
        (),
        2,
        "steps by 0.01 s and cannot vary its step; the communication step (coupling.step) is "
        "0.0333333333 s. Make it 0.01 s or a multiple",
        flags="",
        experiment='stepSize="0.01"',
    ),
    "impossible step": Bad(
        3,
        (),
        2,
        "its step size is '-0.01'; expected a positive number",
        flags='fixedInternalStepSize="-0.01"',
    ),
}

ALONE = {
    "segmentation fault": Bad(
        2,
        ("CRASH",),
        3,
        f"crashed when it was to {STEP}: its process ended with SIGSEGV (segmentation fault). "
        + FAULT,
    ),
    "abort after a message": Bad(
        2,
        ("ABORT",),
        3,
        f"crashed when it was to {STEP}: its process ended with SIGABRT (aborted). The fault is in "
        "the FMU; ask who exported it. It logged: [error] the shaft is broken at t = 0.1 s",
    ),
    "leaves its process": Bad(
        2,
        ("QUIT",),
        3,
        f"crashed when it was to {STEP}: its process ended with exit code 7. {FAULT}",
    ),
    "infinite loop": Bad(
        2,
        ("HANG",),
        3,
        f"was to {STEP} and gave no answer within 1 s, so it was stopped. It hangs, or needs "
        "longer: raise controller.time_limit. It logged nothing.",
    ),
    "segmentation fault at the start": Bad(
        2,
        ("LOAD_CRASH",),
        2,
        "crashed when it was to be loaded and initialized: its process ended with SIGSEGV "
        f"(segmentation fault). {FAULT}",
    ),
    "infinite loop at the start": Bad(
        2,
        ("LOAD_HANG",),
        2,
        "was to be loaded and initialized and gave no answer within 1 s, so it was stopped. It "
        "hangs, or needs longer: raise controller.time_limit. It logged nothing.",
    ),
}


def check(cli: Cli, foreign: Foreign, bad: Bad, *options: str) -> None:
    path = foreign(bad.version, *bad.defines, flags=bad.flags, experiment=bad.experiment)
    said = cli("run", "sphere-lung", "--controller", str(path), *FAST, *options)
    colon = ":" if bad.said.startswith("its ") else ""
    # the terminal breaks lines at 80 columns, also within a path
    text = said.error.replace(" ", "").replace(str(path), "bad.fmu")
    assert text == f"error: FMU bad.fmu{colon} {bad.said}".replace(" ", "")
    assert said.code == bad.code
    if bad.code == 3:
        dataset = xr.load_dataset("out.nc")
        good = 1 if "from t = 0 s" in bad.said else 4
        assert dataset.sizes["time"] == good  # the start, and every step before the failure
        assert dataset.attrs["status"].startswith("failed: FMU")
    else:
        assert not Path("out.nc").exists()


@pytest.mark.parametrize("fault", HERE)
def test_a_bad_fmu_ends_with_its_message_and_the_data_so_far(
    cli: Cli, foreign: Foreign, fault: str
) -> None:
    check(cli, foreign, HERE[fault])


@pytest.mark.slow
@pytest.mark.parametrize("fault", ALONE)
def test_a_crash_or_hang_does_so_too_in_a_process_of_its_own(
    cli: Cli, foreign: Foreign, fault: str
) -> None:
    check(cli, foreign, ALONE[fault], *ISOLATED)


@pytest.mark.parametrize("fault", {**HERE, **ALONE})
def test_the_page_lists_each_bad_fmu_with_its_message(fault: str) -> None:
    bad = {**HERE, **ALONE}[fault]
    rows = [line.split(" | ") for line in PAGE.read_text(encoding="utf-8").splitlines()]
    (row,) = [row for row in rows if row[0] == f"| {fault}"]
    colon = ":" if bad.said.startswith("its ") else ""
    assert row[1:] == [f"FMU bad.fmu{colon} {bad.said}", f"{bad.code} |"]


def test_nan_from_an_fmu_stops_at_the_connection(cli: Cli, foreign: Foreign) -> None:
    path = foreign(2, "NAN_OUTPUT")
    said = cli("run", "sphere-lung", "--controller", str(path), *FAST)
    assert said.code == 3
    said_on_the_page = "connection controller.delta_p → body.delta_p carries nan; look at what "
    assert said.error.startswith(f"error: {said_on_the_page}")
    assert f"| NaN output | {said_on_the_page}" in PAGE.read_text(encoding="utf-8")
    assert xr.load_dataset("out.nc").sizes["time"] == 4


def test_warnings_are_shown_and_kept(cli: Cli, foreign: Foreign) -> None:
    said = cli("run", "sphere-lung", "--controller", str(foreign(2, "WARN")), *FAST)
    assert said.code == 0
    assert "controller warned: the filter is due at t = 0.0333333 s" in said.out
    assert "… 17 more in the dataset's controller_warnings" in said.out
    warnings = xr.load_dataset("out.nc").attrs["controller_warnings"].splitlines()
    assert warnings[19] == "the filter is due at t = 0.666667 s"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (["controller.isolation=thread"], "controller.isolation = 'thread': known: none, process"),
        (["controller.time_limit=1 s"], 'no effect without controller.isolation = "process"'),
        (
            ["controller.isolation=process", "controller.time_limit=5"],
            'controller.time_limit = 5 has no unit; write it like "5 s"',
        ),
        (
            ["controller.isolation=process", "controller.time_limit=0 s"],
            "controller.time_limit = 0 s: expected",
        ),
    ],
)
def test_isolation_that_is_not_there_is_refused(cli: Cli, settings: list[str], said: str) -> None:
    options = [word for setting in settings for word in ("--set", setting)]
    answer = cli("run", "sphere-lung", *FAST, *options)
    assert answer.code == 2
    assert said in answer.error


@pytest.mark.slow
def test_an_isolated_controller_gives_the_same_dataset(cli: Cli) -> None:
    assert cli("run", "sphere-lung", *FAST, "-o", "here.nc").code == 0
    alone = ("--set", "controller.isolation=process", "-o", "alone.nc")
    assert cli("run", "sphere-lung", *FAST, *alone).code == 0
    xr.testing.assert_equal(xr.load_dataset("here.nc"), xr.load_dataset("alone.nc"))


@pytest.mark.slow
def test_ctrl_c_in_a_hanging_fmu_saves_the_data_and_leaves_no_process(
    foreign: Foreign, tmp_path: Path
) -> None:
    path = foreign(2, "HANG")
    options = [*FAST, "--set", "controller.isolation=process", "--quiet"]
    run = subprocess.Popen(
        [sys.executable, "-m", "scenarios", "run", "sphere-lung", "--controller", path, *options],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(PAGE.parents[1])},
        stderr=subprocess.PIPE,
        text=True,
    )
    assert run.stderr is not None
    assert run.stderr.readline() == "hangs\n"  # the FMU says so
    (child,) = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
    run.send_signal(signal.SIGINT)
    _, error = run.communicate(timeout=30)
    assert (run.returncode, error) == (130, "error: interrupted\n")
    assert not Path(f"/proc/{child}").exists()
    assert xr.load_dataset(tmp_path / "out.nc").sizes["time"] == 4
