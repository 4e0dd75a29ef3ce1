"""Steps of an FMU: how long they may be, and how they may end."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

from fmpy.model_description import ModelDescription

from cosim.errors import FmuEndedError, FmuError, FmuStepError
from cosim.fmu.calls import Calls, ShortStep
from cosim.fmu.guard import Guard

_SAME_TIME: Final = 1e-9
"""Part of a step that rounding may leave of it."""


class FixedStep:
    """The one step that an FMU takes; a multiple of it is taken in several.

    Parameters
    ----------
    path : Path
        The FMU, for messages.
    length : float, optional
        The step, s; by default the first one asked for.
    """

    def __init__(self, path: Path, length: float | None = None) -> None:
        self._path = path
        self._length = length

    def parts(self, step: float) -> int:
        """Into how many of its own steps a communication step falls.

        Raises
        ------
        FmuStepError
            If it is no whole number.
        """
        if self._length is None:
            self._length = step
        count = max(1, round(step / self._length))
        if not math.isclose(count * self._length, step, rel_tol=1e-9):
            raise FmuStepError(
                f"FMU {self._path} steps by {self._length:.9g} s and cannot vary its step; the "
                f"communication step is {step:.9g} s. Make it {self._length:.9g} s or a multiple",
                settings=["communication step"],
            )
        return count


def fixed_step(path: Path, description: ModelDescription, folder: Path) -> FixedStep | None:
    """Read from a model description what steps an FMU takes; None if it takes any.

    An FMU that cannot vary its step says which one it takes in ``fixedInternalStepSize`` (FMI 3.0)
    or as the step size of its default experiment.

    Raises
    ------
    FmuError
        If that is no positive number.
    """
    about = description.coSimulation
    varies = about.canHandleVariableCommunicationStepSize
    if description.fmiVersion.startswith("1."):
        varies = _varies_fmi1(folder)  # which fmpy does not read
    if varies:
        return None
    experiment = description.defaultExperiment
    text = about.fixedInternalStepSize or (experiment.stepSize if experiment is not None else None)
    try:
        length = None if text is None else float(text)
    except ValueError:
        length = math.nan
    if length is not None and not (math.isfinite(length) and length > 0):
        raise FmuError(f"FMU {path}: its step size is {text!r}; expected a positive number")
    return FixedStep(path, length)


def _varies_fmi1(folder: Path) -> bool:
    root = ET.parse(folder / "modelDescription.xml").getroot()
    flags = root.find("Implementation/*/Capabilities")
    flag = None if flags is None else flags.get("canHandleVariableCommunicationStepSize")
    return flag in ("true", "1")


def advance(calls: Calls, guard: Guard, start: float, step: float, *, final: bool) -> None:
    """Let an FMU step, and go on for the rest where it returns early.

    Parameters
    ----------
    calls : Calls
        The FMU.
    guard : Guard
        Of its failures.
    start, step : float
        From when, and how far, s.
    final : bool
        No state of before `start` will be restored.

    Raises
    ------
    FmuStepError
        If it refuses the step, or stands still.
    FmuEndedError
        If it asks to end the simulation.
    FmuError
        If it fails.
    """
    time, left, end = start, step, start + step
    while True:
        short = guard.call("step from t = {:.6g} s by {:.6g} s", calls.do_step, time, left, final)
        if short is None:
            return
        reached = end if short.reached is None else short.reached
        if short.ended:
            raise FmuEndedError(
                f"FMU {guard.path} asked to end the simulation at t = {reached:.6g} s. {guard.log}"
            )
        if short.refused or not reached > time:
            raise FmuStepError(_refusal(guard, time, left, short), settings=["communication step"])
        time, left = reached, end - reached
        if left <= _SAME_TIME * step:
            return


def _refusal(guard: Guard, start: float, step: float, short: ShortStep) -> str:
    what = "refused the step (status discard)" if short.refused else "did not move on in the step"
    came = "" if short.reached is None else f"; it came to t = {short.reached:.6g} s"
    return (
        f"FMU {guard.path} {what} from t = {start:.6g} s by {step:.6g} s{came}. Try a shorter "
        f"communication step. {guard.log}"
    )
