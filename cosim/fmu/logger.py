"""The logger that FMUs of FMI 1.0 and 2.0 call: one for all of them.

fmpy's proxy, which formats a message from C's variable arguments, hands all messages of a process
to the logger that was set last. So there is one, which is never freed, and which looks up whose
message it is by the name of the instance. FMI asks for unique names anyway.
"""

from __future__ import annotations

import ctypes
from itertools import count
from typing import Any, Final
from weakref import WeakValueDictionary

import fmpy
from fmpy import fmi1, fmi2

from cosim.fmu.log import FmuLog

_LOGS: Final[WeakValueDictionary[bytes, FmuLog]] = WeakValueDictionary()


def unique_name(name: str, log: FmuLog) -> str:
    """Name of an instance that no other has; its messages go to `log`."""
    candidates = (name if i == 1 else f"{name}-{i}" for i in count(1))
    unique = next(candidate for candidate in candidates if candidate.encode() not in _LOGS)
    _LOGS[unique.encode()] = log
    return unique


def callbacks1() -> fmi1.fmi1CallbackFunctions:
    """Functions that FMUs of FMI 1.0 call."""
    callbacks = fmi1.fmi1CallbackFunctions(_LOGGER1, _ALLOCATE1, _FREE1)
    _add_proxy(callbacks)
    return callbacks


def callbacks2() -> fmi2.fmi2CallbackFunctions:
    """Functions that FMUs of FMI 2.0 call."""
    callbacks = fmi2.fmi2CallbackFunctions(_LOGGER2, _ALLOCATE2, _FREE2)
    _add_proxy(callbacks)
    return callbacks


def _add_proxy(callbacks: fmi1.fmi1CallbackFunctions | fmi2.fmi2CallbackFunctions) -> None:
    """Let fmpy's proxy format messages, where it has one: there is none for Linux on ARM."""
    try:
        from fmpy.logging import addLoggerProxy  # loads a library
    except OSError:
        return  # messages come as their formats, such as "pressure %g"
    addLoggerProxy(ctypes.byref(callbacks))


def _deliver(_: Any, name: bytes | None, status: int, __: bytes, message: bytes) -> None:
    log = _LOGS.get(name or b"")
    if log is None and len(_LOGS) == 1:  # an FMU that does not keep to its name, but is alone
        (log,) = _LOGS.values()
    if log is not None:
        log.add(status, message)


_LOGGER1: Final = fmi1.fmi1CallbackLoggerTYPE(_deliver)
_LOGGER2: Final = fmi2.fmi2CallbackLoggerTYPE(_deliver)
_ALLOCATE1: Final = fmi1.fmi1CallbackAllocateMemoryTYPE(fmpy.calloc)
_ALLOCATE2: Final = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
_FREE1: Final = fmi1.fmi1CallbackFreeMemoryTYPE(fmpy.free)
_FREE2: Final = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
