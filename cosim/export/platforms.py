"""Where an FMU can run."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import fmpy

PLATFORM: Final[str] = fmpy.platform
"""This machine, in the words of FMI 2.0."""


def platforms_of(fmu: Path) -> list[str]:
    """Platforms that an FMU has binaries for."""
    return sorted(fmpy.supported_platforms(str(fmu)))
