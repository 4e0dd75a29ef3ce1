"""A controller that ships, built with other start values."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from cosim.controllers import build
from cosim.errors import ControllerError
from cosim.fmu.parameters import Value

_CLASS: Final = re.compile(r"^class (\w+)\((?:Fmi2Slave|Controller)\):", re.MULTILINE)

_CONFIGURED: Final = '''

class {name}({name}):
    """The same, with other start values."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for name, value in {starts!r}.items():
            setattr(self, name, value)
'''


def build_configured(source: Path, starts: Mapping[str, Value], destination: Path) -> Path:
    """Build a controller whose parameters start with other values.

    Parameters
    ----------
    source : Path
        Its Python file, with one class that derives from ``Controller`` or ``Fmi2Slave`` itself.
    starts : mapping
        Values by name, in the units of the source.
    destination : Path
        The FMU to write.

    Raises
    ------
    ControllerError
        If the source is not as expected, or cannot be built.
    """
    text = source.read_text(encoding="utf-8")
    names = _CLASS.findall(text)
    if len(names) != 1:
        raise ControllerError(
            f"controller source {source}: expected one class of Controller or Fmi2Slave"
        )
    with tempfile.TemporaryDirectory(prefix="softbody-export-") as folder:
        script = Path(folder) / source.name
        script.write_text(
            text + _CONFIGURED.format(name=names[0], starts=dict(starts)), encoding="utf-8"
        )
        return build(script, destination)
