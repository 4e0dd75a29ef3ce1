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

__all__ = ["CONTROLLERS", "build", "controller_fmu", "controller_source", "new_source"]


def controller_source(use: str, folder: Path = Path()) -> Path:
    """Source file of a controller that ships, by name, or one in a Python file.

    Parameters
    ----------
    use : str
        A name in `CONTROLLERS`, or a file that ends in ``.py``.
    folder : Path
        Against which a file's path is read.

    Raises
    ------
    ControllerError
        If none ships under that name.
    """
    if use.endswith(".py"):
        return folder / use
    if use not in CONTROLLERS:
        raise ControllerError(f"no controller is named {use!r}; {nearest(use, CONTROLLERS)}")
    return Path(__file__).with_name(CONTROLLERS[use])


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


def controller_fmu(use: str, folder: Path = Path()) -> Path:
    """FMU of a controller that ships or of a source, from the user's cache; built if not there.

    The file's name holds the hash of its content, so a changed source is never answered by an old
    FMU.

    Parameters
    ----------
    use, folder
        As of `controller_source`.

    Raises
    ------
    ControllerError
        If there is no such source, or it cannot be built.
    """
    source = controller_source(use, folder)
    if not source.is_file():
        raise ControllerError(f"controller source {source} does not exist; check the path")
    file = f"{Path(use).stem}-{content_hash(source)[:16]}.fmu"
    cached = platformdirs.user_cache_path("softbody-cosim") / file
    if cached.is_file():
        return cached
    try:
        cached.parent.mkdir(parents=True, exist_ok=True)
        temporary = tempfile.TemporaryDirectory(dir=cached.parent)
    except OSError:  # a home that cannot be written: build for this process alone
        return build(source, Path(tempfile.mkdtemp(prefix="softbody-cosim-")) / file)
    with temporary as name:
        # Moved at once, so that another process never sees half a file.
        build(source, Path(name) / file).replace(cached)
    return cached
