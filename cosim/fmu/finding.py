"""Something that was found of an FMU, and the FMU that is looked at."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from pathlib import Path

from fmpy.model_description import ModelDescription, ModelVariable

from cosim.errors import FmuError


@dataclass(frozen=True)
class Finding:
    """Something about an FMU, in plain words.

    Attributes
    ----------
    text : str
        What, and what to do about it.
    fault : bool
        True if it keeps the FMU from being coupled; False for a note.
    settings : tuple of str
        As of `cosim.errors.CosimError`.
    """

    text: str
    fault: bool = False
    settings: tuple[str, ...] = ()

    @classmethod
    def of(cls, path: Path, error: FmuError, *, fault: bool = True) -> Finding:
        """Make one of an error, without the FMU's path, which stands above the findings."""
        return cls(message_of(path, error), fault, error.settings)


@dataclass(frozen=True)
class Subject:
    """An FMU that is looked at.

    Attributes
    ----------
    path, folder : Path
        Its file, and the folder it is unpacked in.
    description : ModelDescription
        What it says of itself.
    step : float
        Communication step that it should take, s.
    """

    path: Path
    folder: Path
    description: ModelDescription
    step: float

    def only(self, variable: ModelVariable) -> ModelDescription:
        """Return the description with one variable, so that each is judged by itself."""
        alone = copy.copy(self.description)
        alone.modelVariables = [variable]
        return alone


def message_of(path: Path, error: FmuError) -> str:
    """Text of an error without the FMU's path."""
    return str(error).removeprefix(f"FMU {path}").lstrip(": ").removeprefix(f"{path} ")
