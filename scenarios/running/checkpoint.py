"""Checkpoints: everything that a run needs to go on in another process, in one file.

The file is a NumPy archive (.npz) without pickled objects. It holds plain arrays, the states of the
participants as bytes, and a header in JSON. It is replaced at once, so that a run that is killed
leaves a whole one.
"""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cosim.loop import SerializedCoSimulation
from scenarios.errors import CheckpointError
from scenarios.results.files import replacing
from scenarios.running.provenance import Provenance

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

    def due(self, steps: int) -> bool:
        """Whether one is written after so many communication steps."""
        return steps > 0 and steps % self.every == 0

    def write(self, provenance: Provenance, state: SessionState) -> None:
        """Write one; the one before is replaced only when this one is whole.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        write(self.path, Checkpoint(provenance, state, self.every, self.attributes))


@dataclass(frozen=True)
class SessionState:
    """Where a run stands.

    Attributes
    ----------
    loop : SerializedCoSimulation
        The co-simulation.
    arrays : mapping
        What was recorded so far.
    wall_time : float
        Computing time so far, s.
    warnings : sequence of str
        What the controller's FMU warned of so far.
    """

    loop: SerializedCoSimulation
    arrays: Mapping[str, NDArray[np.float64]]
    wall_time: float
    warnings: list[str]


@dataclass(frozen=True)
class Checkpoint:
    """What a checkpoint holds.

    Attributes
    ----------
    provenance : Provenance
        Of the run.
    state : SessionState
        Where it stands.
    every, attributes
        As of `Checkpoints`.
    """

    provenance: Provenance
    state: SessionState
    every: int
    attributes: Mapping[str, Any]


def write(path: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; an older one there is replaced only when the new one is whole.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    state = checkpoint.state
    header = {
        "provenance": asdict(checkpoint.provenance),
        "every": checkpoint.every,
        "attributes": dict(checkpoint.attributes),
        "index": state.loop.index,
        "memory": state.loop.coupler,
        "wall_time": state.wall_time,
        "warnings": state.warnings,
    }
    entries: dict[str, Any] = {
        _HEADER: np.frombuffer(json.dumps(header).encode(), np.uint8),
        **{_ARRAY + name: values for name, values in state.arrays.items()},
        **{
            _PARTICIPANT + name: np.frombuffer(data, np.uint8)
            for name, data in state.loop.participants.items()
        },
    }
    with replacing(path, "checkpoint") as partial, partial.open("wb") as file:
        np.savez(file, allow_pickle=False, **entries)
        file.flush()
        os.fsync(file.fileno())


def read(path: Path) -> Checkpoint:
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
        states = {name: values.tobytes() for name, values in _named(entries, _PARTICIPANT)}
        return Checkpoint(
            Provenance(**header["provenance"]),
            SessionState(
                SerializedCoSimulation(header["index"], states, header["memory"]),
                dict(_named(entries, _ARRAY)),
                header["wall_time"],
                header["warnings"],
            ),
            header["every"],
            header["attributes"],
        )
    except FileNotFoundError as error:
        raise CheckpointError(
            f"checkpoint {path} does not exist; softbody run … --checkpoint N writes one"
        ) from error
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise CheckpointError(
            f"checkpoint {path} cannot be read ({error}): it is damaged, or no checkpoint; run the "
            "scenario again"
        ) from error


def _named(entries: Mapping[str, NDArray[Any]], prefix: str) -> list[tuple[str, NDArray[Any]]]:
    """Entries whose names begin with a prefix, without it."""
    return [
        (name.removeprefix(prefix), values)
        for name, values in entries.items()
        if name.startswith(prefix)
    ]
