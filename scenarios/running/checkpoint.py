"""Checkpoints: everything that a run needs to go on in another process, in one file.

The file is a NumPy archive (.npz) without pickled objects. It holds plain arrays, what the
participants dumped, and a header in JSON. It is replaced at once, so that a run that is killed
leaves a whole one.
"""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cosim.loop import DumpedLoop
from scenarios.errors import CheckpointError, OutputError

SUFFIX: Final = ".checkpoint"

_HEADER: Final = "header"
_PARTICIPANT: Final = "participant/"
_ARRAY: Final = "array/"


@dataclass(frozen=True)
class Checkpoints:
    """Where and how often a run writes them.

    Attributes
    ----------
    path : Path
        The file; each checkpoint takes the place of the one before.
    every : int
        Communication steps from one to the next.
    attributes : mapping
        Attributes of the dataset that the run itself does not know.
    """

    path: Path
    every: int
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the interval, and take a path that is text."""
        object.__setattr__(self, "path", Path(self.path))
        if not isinstance(self.every, int) or self.every < 1:
            raise CheckpointError(
                f"a checkpoint every {self.every} communication steps: expected a whole number "
                "of them, 1 or more"
            )


@dataclass(frozen=True)
class Kept:
    """What a checkpoint holds.

    Attributes
    ----------
    name, scenario : str
        Name and text of the scenario, with paths that hold everywhere.
    loop : DumpedLoop
        The co-simulation.
    arrays : mapping
        What was recorded so far.
    about : mapping
        The rest, as JSON holds it: the controller's hash, versions, wall time, and options.
    """

    name: str
    scenario: str
    loop: DumpedLoop
    arrays: Mapping[str, NDArray[np.float64]]
    about: Mapping[str, Any]


def write(path: Path, kept: Kept) -> None:
    """Write a checkpoint; an older one there is replaced only when the new one is whole.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    header = {
        "name": kept.name,
        "scenario": kept.scenario,
        "index": kept.loop.index,
        "memory": kept.loop.memory,
        "about": kept.about,
    }
    entries: dict[str, Any] = {
        _HEADER: np.frombuffer(json.dumps(header).encode(), np.uint8),
        **{_ARRAY + name: values for name, values in kept.arrays.items()},
        **{
            _PARTICIPANT + name: np.frombuffer(state, np.uint8)
            for name, state in kept.loop.participants.items()
        },
    }
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with partial.open("wb") as file:
            np.savez(file, allow_pickle=False, **entries)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(f"checkpoint {path} cannot be written: {error}") from error


def read(path: Path) -> Kept:
    """Read a checkpoint.

    Raises
    ------
    CheckpointError
        If there is none, or it is damaged.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            entries = dict(archive)  # a zip file: each entry is checked against its CRC
        header = json.loads(entries.pop(_HEADER).tobytes())
        states = {
            name.removeprefix(_PARTICIPANT): values.tobytes()
            for name, values in entries.items()
            if name.startswith(_PARTICIPANT)
        }
        arrays = {
            name.removeprefix(_ARRAY): values
            for name, values in entries.items()
            if name.startswith(_ARRAY)
        }
        loop = DumpedLoop(header["index"], states, header["memory"])
        return Kept(header["name"], header["scenario"], loop, arrays, header["about"])
    except FileNotFoundError as error:
        raise CheckpointError(
            f"checkpoint {path} does not exist; softbody run … --checkpoint N writes one"
        ) from error
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise CheckpointError(
            f"checkpoint {path} cannot be read ({error}): it is damaged, or no checkpoint; run the "
            "scenario again"
        ) from error
