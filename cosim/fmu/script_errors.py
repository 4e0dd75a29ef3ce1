"""Errors of a controller's script, with the line of the source that they come from."""

from __future__ import annotations

import re
import traceback
from pathlib import Path
from typing import Final

_MARK: Final = re.compile(r"# line (\d+) of the source:")


def described(error: Exception, resources: Path) -> str:
    """Text of a script's error, with the last place in its source that it passed.

    Parameters
    ----------
    error : Exception
        Raised by the script.
    resources : Path
        Folder of the script.
    """
    where = ""
    for frame in traceback.extract_tb(error.__traceback__):
        path = Path(frame.filename)
        if path.is_relative_to(resources):
            line = _source_line(path, frame.lineno or 0)
            where = where if line is None else f" (line {line}, {frame.name})"
    return f"{type(error).__name__}: {error}{where}"


def line_mark(line: int) -> str:
    """What a build writes above a line of the source that is not in its own place any more."""
    return f"# line {line} of the source:"


def _source_line(script: Path, line: int) -> int | None:
    """Line of the source that a line of the script was; None if a build put it there."""
    lines = script.read_text(encoding="utf-8", errors="replace").splitlines()
    marks = [(place, m) for place, text in enumerate(lines, 1) if (m := _MARK.fullmatch(text))]
    if not marks:
        return line
    place, match = marks[-1]
    return None if line < place else int(match[1]) + line - place - 1
