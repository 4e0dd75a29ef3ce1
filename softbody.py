"""All public names of scenarios, cosim and softbody_core, and the command line.

>>> import softbody
>>> softbody.load("lung").title
'One anatomical lung (Table 2 C)'
"""

from __future__ import annotations

import importlib
import sys
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

_PACKAGES: Final = {"scenarios": "run", "cosim": "cosimulate", "softbody_core": "SoftBody"}
"""What is public here, and a name by which each package is known for ours."""

_HOME: Final = Path(__file__).resolve().parent


def __getattr__(name: str) -> Any:
    if name == "__all__":  # for `from softbody import *`
        return sorted(_homes())
    if name.startswith("_") or name not in _homes():
        raise AttributeError(f"module 'softbody' has no attribute {name!r}")
    return getattr(importlib.import_module(_homes()[name]), name)


def __dir__() -> list[str]:
    return sorted({"main", *_homes()})


def main() -> int:
    """Run the command line; return its exit code."""
    try:
        _homes()
        from scenarios.__main__ import main as command_line  # once it is known to be ours
    except ImportError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    return command_line()


@cache
def _homes() -> dict[str, str]:
    """Package that each public name comes from; all three are looked at first."""
    return {name: package for package in _PACKAGES for name in _public(package)}


def _public(package: str) -> list[str]:
    """Public names of one of the packages.

    Raises
    ------
    ImportError
        If another package answers to its name.
    """
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise ImportError(f"package {package!r} is missing; install softbody-cosim again")
    expected = _HOME / package / "__init__.py"
    if Path(spec.origin).resolve() != expected:
        raise ImportError(
            f"{package!r} is found in {spec.origin}, and that of softbody-cosim in {expected}: "
            "rename the former, or take its folder off PYTHONPATH and out of the working directory"
        )
    names: list[str] = getattr(importlib.import_module(package), "__all__", [])
    if _PACKAGES[package] not in names:
        raise ImportError(
            f"{expected} was overwritten by another package of the name {package!r}; uninstall "
            "that one, then run: pip install --force-reinstall softbody-cosim"
        )
    return names


if __name__ == "__main__":
    sys.exit(main())
