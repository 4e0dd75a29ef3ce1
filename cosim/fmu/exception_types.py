"""Python's exception types, kept alive for FMUs whose script raises.

In Python 3.12 these types are immortal only as long as no library of an older stable ABI, such as
that of netCDF4, counts references to them. From then on the count is too low, and pythonfmu's
binary, which counts in 32 bits, frees a type when a script raises: the process ends.
"""

from __future__ import annotations

import builtins
import ctypes
from typing import Final

_TYPES: Final = [
    kind
    for kind in vars(builtins).values()
    if isinstance(kind, type) and issubclass(kind, BaseException)
]
_SPARE: Final = 100
"""References to each type, a good many more than an FMU can lose before it has failed."""


def keep_exception_types_alive() -> None:
    """Add references that are never given back, 50 kB of them."""
    references = _TYPES * _SPARE
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(references))
