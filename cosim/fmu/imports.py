"""What Python remembers of code that was run from a folder that goes."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def imports_undone(folder: Path) -> Iterator[None]:
    """Undo what code from a folder does to Python as it is loaded.

    Its entries in ``sys.path`` go, and so do modules imported from the folder, or from files that
    are gone: they would answer another script's import of the same name. The code itself keeps
    what it has imported. The working directory, which a failed load leaves changed, is set back.
    """
    path, modules, working = list(sys.path), set(sys.modules), Path.cwd()
    try:
        yield
    finally:
        os.chdir(working)
        sys.path[:] = path
        for name in set(sys.modules) - modules:
            file = getattr(sys.modules[name], "__file__", None)
            if file is not None and (Path(file).is_relative_to(folder) or not Path(file).exists()):
                del sys.modules[name]
