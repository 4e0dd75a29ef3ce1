"""Where in a scenario the settings are that messages of `cosim` name."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

from cosim.errors import CosimError
from softbody_core import SimulationError

_PATHS: Final = {
    "communication step": "communication step (coupling.step)",
    "time_limit": "controller.time_limit",
    "names": "[controller.ports]",
}
"""By setting; all others are options of the coupling."""


def with_paths(text: str, settings: Sequence[str]) -> str:
    """Put the path in a scenario in the place of each setting that a message names."""
    for setting in settings:
        word = re.compile(rf"(?<![\w./]){re.escape(setting)}(?![\w/])")
        text = word.sub(_path(setting), text, count=1)
    return text


def message_with_paths(error: SimulationError) -> str:
    """Message of an error, with paths."""
    return with_paths(str(error), error.settings if isinstance(error, CosimError) else ())


@contextmanager
def errors_with_paths() -> Iterator[None]:
    """Give errors of `cosim` messages with paths, as they pass."""
    try:
        yield
    except CosimError as error:
        error.args, error.settings = (message_with_paths(error),), ()
        raise


def _path(setting: str) -> str:
    if setting.startswith("names."):
        return setting.replace("names", "controller.ports", 1)
    return _PATHS.get(setting, f"coupling.{setting}")
