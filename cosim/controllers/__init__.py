"""Controllers: the sources that ship beside this file, built into FMUs on first use.

A new controller is one file here and one line in `CONTROLLERS`. What they share is in `frame.py`,
whose text is built into each FMU: a module that two FMUs shared would be found by its name, and so
be taken from the one that was loaded first.
"""

from __future__ import annotations

import keyword
import re
import sys
import tempfile
from pathlib import Path
from typing import Final

import platformdirs

from cosim.controllers.build import build, content_hash
from cosim.errors import ControllerError, nearest

CONTROLLERS: Final[dict[str, str]] = {
    "paper": "paper.py",
    "pressure-control": "pressure_control.py",
    "volume-control": "volume_control.py",
    "pressure-support": "pressure_support.py",
    "cpap": "cpap.py",
    "muscle-effort": "muscle_effort.py",
    "pid": "pid.py",
    "hysteresis": "hysteresis.py",
}

_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")

__all__ = ["CONTROLLERS", "build", "controller_fmu", "controller_source", "fmu_of", "new_source"]


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


def new_source(name: str) -> str:
    """Text of a controller that works, for its author to change.

    Parameters
    ----------
    name : str
        Of the file, without ``.py``; the class is named after it.

    Raises
    ------
    ControllerError
        If a file of that name would not do.
    """
    if not _NAME.fullmatch(name):
        raise ControllerError(
            f"{name!r} is no name for a controller; expected small letters, digits and "
            "underscores, like 'my_vent'"
        )
    if name in sys.stdlib_module_names or keyword.iskeyword(name):
        raise ControllerError(f"{name!r} belongs to Python; choose another name, like 'my_{name}'")
    if name in CONTROLLERS:
        raise ControllerError(
            f"a controller named {name!r} ships already; choose another name, like 'my_{name}'"
        )
    text = Path(__file__).with_name("template.py").read_text(encoding="utf-8")
    title = "".join(part.capitalize() for part in name.split("_"))
    return text.replace("class Template(", f"class {title}(")


def controller_fmu(name: str) -> Path:
    """FMU of a controller that ships; see `fmu_of`."""
    return fmu_of(controller_source(name), name)


def fmu_of(source: Path, name: str | None = None) -> Path:
    """FMU of a controller's source, from the user's cache, built if it is not there.

    The file's name holds the hash of its content, so a changed source is never answered by an old
    FMU.

    Parameters
    ----------
    source : Path
        A Python file with a pythonfmu class.
    name : str, optional
        What the FMU's file name begins with; that of the source by default.

    Raises
    ------
    ControllerError
        If the source does not exist, or cannot be built.
    """
    if not source.is_file():
        raise ControllerError(f"controller source {source} does not exist; check the path")
    file = f"{name or source.stem}-{content_hash(source)[:16]}.fmu"
    cached = platformdirs.user_cache_path("softbody-cosim") / file
    if cached.is_file():
        return cached
    try:
        cached.parent.mkdir(parents=True, exist_ok=True)
        folder = tempfile.TemporaryDirectory(dir=cached.parent)
    except OSError:  # a home that cannot be written: build for this process alone
        return build(source, Path(tempfile.mkdtemp(prefix="softbody-cosim-")) / file)
    with folder as place:
        # Moved at once, so that another process never sees half a file.
        build(source, Path(place) / file).replace(cached)
    return cached
