"""A scenario's body in a folder, and from there back to a participant."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from cosim import SoftBodyParticipant
from scenarios.export.parameters import integrator_name
from scenarios.running.assemble import build_body
from scenarios.scene.parse import parse
from scenarios.scene.scenario import Scenario

_SCENARIO: Final = "scenario.toml"

_SHIM: Final = '''"""The soft body of the scenario beside this file; made by `softbody export`."""

from pathlib import Path

try:
    from cosim.export import Interface
    from cosim.export.slave{fmi} import ParticipantSlave as Fmi{fmi}Slave
    from scenarios.export.packing import open_body
except ImportError as error:
    raise ImportError(
        f"this FMU needs the package softbody-cosim in the Python that its host runs ({{error}})"
    ) from error


class SoftBody(Fmi{fmi}Slave):
    interface = Interface.read(Path(__file__).parent)

    def open(self, folder, changed):
        return open_body(folder, changed)
'''


def shim(fmi: int) -> str:
    """Script of an exported FMU, for a version of FMI."""
    return _SHIM.format(fmi=fmi)


def pack(scenario: Scenario, folder: Path) -> list[Path]:
    """Write a scenario's text and the surfaces that it names into a folder.

    Returns
    -------
    list of Path
        The files.
    """
    # A host may change a number of the integrator, which has to be named then.
    changes = {"integrator.method": integrator_name(scenario)}
    meshes = {"mesh": scenario.mesh}
    meshes |= {f"obstacles.{obstacle.name}.mesh": obstacle.mesh for obstacle in scenario.obstacles}
    files = []
    for number, (path, mesh) in enumerate(meshes.items()):
        if mesh.file is not None:
            source = scenario.folder / mesh.file
            files.append(Path(shutil.copy(source, folder / f"surface-{number}{source.suffix}")))
            changes[f"{path}.file"] = files[-1].name
    text = folder / _SCENARIO
    text.write_text(scenario.text_with(changes), encoding="utf-8")
    return [text, *files]


def open_body(folder: Path, changed: Mapping[str, float | int | str]) -> SoftBodyParticipant:
    """Make the body of what `pack` wrote.

    Parameters
    ----------
    folder : Path
        Where it was written.
    changed : mapping
        Values to put in place first, by dotted path.

    Raises
    ------
    ScenarioError
        If a value does not fit.
    """
    text = (folder / _SCENARIO).read_text(encoding="utf-8")
    scenario = parse("of the FMU", text, folder, changed)
    return SoftBodyParticipant(build_body(scenario), inputs=scenario.inputs)
