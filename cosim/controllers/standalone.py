"""A controller's source as it is built: with `frame.py` in the place of its import."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Final

from cosim.fmu.script_errors import line_mark

FRAME: Final = "cosim.controllers.frame"

_HEAD: Final = "# From softbody-cosim, cosim/controllers/frame.py:\n\n"


def standalone(source: Path) -> bytes:
    """Read a source so that it runs where this package is not installed.

    A source that does not import the frame is given as it is. So is one that cannot be parsed:
    whoever imports it finds out why.
    """
    data = source.read_bytes()
    try:
        body = ast.parse(data).body
    except (SyntaxError, ValueError):
        return data
    imports = [node for node in body if isinstance(node, ast.ImportFrom) and node.module == FRAME]
    lines = data.decode("utf-8").splitlines(keepends=True) if imports else []
    for node in reversed(imports):
        first, last = node.lineno - 1, node.end_lineno or node.lineno
        renamed = [f"{n.asname} = {n.name}\n" for n in node.names if n.asname is not None]
        lines[first:last] = [_HEAD, _frame(), *renamed, f"\n{line_mark(last + 1)}\n"]
    return "".join(lines).encode() if imports else data


def _frame() -> str:
    """Text of the frame without its docstring."""
    text = Path(__file__).with_name("frame.py").read_text(encoding="utf-8")
    docstring = ast.parse(text).body[0]
    return "".join(text.splitlines(keepends=True)[docstring.end_lineno :]).lstrip("\n")
