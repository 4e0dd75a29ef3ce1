"""The controllers that ship: sources beside this file, built into FMUs on first use.

A new controller is one file here and one line in `CONTROLLERS`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Final

import platformdirs

from cosim.controllers.build import build, content_hash
from cosim.errors import ControllerError, nearest

CONTROLLERS: Final[dict[str, str]] = {
    "paper": "paper.py",
    "pressure-control": "pressure_control.py",
}

__all__ = ["CONTROLLERS", "build", "controller_fmu", "controller_source"]


def controller_source(name: str) -> Path:
    """Source file of a controller that ships.

    Raises
    ------
    ControllerError
        If there is none of that name.
    """
    if name not in CONTROLLERS:
        raise ControllerError(f"no controller is named {name!r}; {nearest(name, CONTROLLERS)}")
    return Path(__file__).with_name(CONTROLLERS[name])


def controller_fmu(name: str) -> Path:
    """FMU of a controller that ships, from the user's cache, built if it is not there.

    The file's name holds the hash of its content, so a changed source is never answered by an old
    FMU.
    """
    source = controller_source(name)
    file = f"{name}-{content_hash(source)[:16]}.fmu"
    cached = platformdirs.user_cache_path("softbody-cosim") / file
    if cached.is_file():
        return cached
    try:
        cached.parent.mkdir(parents=True, exist_ok=True)
        folder = tempfile.TemporaryDirectory(dir=cached.parent)
    except OSError:  # a home that cannot be written: build for this process alone
        return build(source, Path(tempfile.mkdtemp(prefix="softbody-cosim-")) / file)
    with folder as name:
        # Moved at once, so that another process never sees half a file.
        build(source, Path(name) / file).replace(cached)
    return cached
