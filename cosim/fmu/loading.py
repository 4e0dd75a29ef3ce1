"""From a model description to an instance with its parameters."""

from __future__ import annotations

from collections.abc import Sequence

from fmpy.model_description import ModelDescription

from cosim.fmu.calls import Calls, LoadingError
from cosim.fmu.folder import FmuFolder
from cosim.fmu.guard import Guard
from cosim.fmu.log import FmuLog
from cosim.fmu.logger import unique_name
from cosim.fmu.parameters import Assignment
from cosim.fmu.python_slave import Fmi2Python
from cosim.fmu.run_as import RunAs
from cosim.fmu.versions import VERSIONS


def load(
    description: ModelDescription, folder: FmuFolder, run_as: RunAs, name: str, log: FmuLog
) -> Calls:
    """Load an FMU's library, or its script, and make an instance with a name.

    Raises
    ------
    LoadingError
        If the library does not load, lacks a function, or makes no instance; or the script fails.
    """
    arguments = {
        "guid": description.instantiationToken,
        "unzipDirectory": str(folder.path),
        "modelIdentifier": description.coSimulation.modelIdentifier,
        "instanceName": unique_name(name, log),
    }
    version = description.fmiVersion
    if run_as == "python":
        script = Fmi2Python(arguments, log)
        script.instantiate()
        return script
    try:
        calls = VERSIONS[version[0]](arguments, log)
    except Exception as error:  # an OSError in a plain Exception, or an AttributeError of ctypes
        reason = str(error).replace(f"{folder.path}/", "").rstrip(".")
        raise LoadingError(
            f"{reason}. Its binary has to hold every function of FMI {version} and find the "
            "libraries that it uses; export it again, with its libraries linked in"
        ) from error
    try:
        calls.instantiate()
    except Exception as error:
        raise LoadingError(
            f"it makes no instance for the GUID {arguments['guid']!r} of its modelDescription.xml. "
            "Its binary may be of another export, or miss something that it needs; export it again"
        ) from error
    return calls


def assign(calls: Calls, parameters: Sequence[Assignment], guard: Guard) -> None:
    """Set parameters; structural ones first, in the mode that is there for them."""
    sizes = [p for p in parameters if p.variable.causality == "structuralParameter"]
    if sizes:
        guard.call("be configured", calls.fmu.enterConfigurationMode)
        for parameter in sizes:
            guard.call("take {1}", _assign, calls, parameter)
        guard.call("be configured", calls.fmu.exitConfigurationMode)
    for parameter in parameters:
        if parameter not in sizes:
            guard.call("take {1}", _assign, calls, parameter)


def _assign(calls: Calls, parameter: Assignment) -> None:
    variable = parameter.variable
    calls.assign(calls.kind(variable), variable.valueReference, parameter.values)
