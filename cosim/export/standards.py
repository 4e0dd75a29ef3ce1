"""The versions of FMI that FMUs are exported in."""

from __future__ import annotations

from cosim.controllers.build import FMI2, Standard
from cosim.errors import ControllerError


def standard(fmi: int) -> Standard:
    """How FMUs of FMI 2.0 or 3.0 are made.

    Parameters
    ----------
    fmi : {2, 3}
        Version.

    Raises
    ------
    ControllerError
        For another version, or if FMI 3.0 is asked for and pythonfmu3 is not installed.
    """
    if fmi == 2:
        return FMI2
    if fmi != 3:
        raise ControllerError(f"FMI {fmi} is not known; expected 2 or 3")
    try:
        from cosim.export.fmi3 import FMI3
    except ModuleNotFoundError as error:
        raise ControllerError(
            f"FMI 3.0 needs the package {error.name}; install it with: pip install {error.name}"
        ) from error
    return FMI3
