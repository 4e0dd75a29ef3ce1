"""Run an exported loop in several masters: how far they agree, and what a step costs.

    python tools/masters/compare.py --ecos ecos/bin/python

See ``run_ecos.py`` for the environment of Ecos; without one it is left out. Each step
counts as long as in the best of some repetitions, because others may use the machine.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from fmpy.ssp.simulation import simulate_ssp

import scenarios
from cosim import FmuParticipant, cosimulate
from scenarios.export.system import export_ssp

REPEATS = 7


@dataclass(frozen=True)
class Outcome:
    """Volumes at the communication points, L, and the clock at each, s; at fewer if need be."""

    volumes: list[float]
    clock: list[float]


class Bare:
    """One FMU, and nothing between it and fmpy."""

    def __init__(self, path: Path) -> None:
        description = fmpy.read_model_description(str(path))
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=fmpy.extract(str(path)),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=path.stem,
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        at = {variable.name: variable.valueReference for variable in description.modelVariables}
        self.volumes = [at["volume"], at["bounding_box_volume"]]
        self.drives = [at["delta_p"], at["n"]]

    def close(self) -> None:
        """End it."""
        self.slave.terminate()
        self.slave.freeInstance()


def bare_loop(folder: Path, scene: scenarios.Scenario, *, in_turn: bool) -> Outcome:
    """A loop of a dozen lines over fmpy."""
    controller, body = (Bare(folder / f"resources/{name}.fmu") for name in ("controller", "body"))
    step = scene.coupling.step
    volumes = [body.slave.getReal(body.volumes)[0]]
    clock = [time.perf_counter()]
    for index in range(scene.steps):
        seen = body.slave.getReal(body.volumes)
        given = controller.slave.getReal(controller.drives)
        controller.slave.setReal(controller.volumes, seen)
        controller.slave.doStep(index * step, step)
        if in_turn:
            given = controller.slave.getReal(controller.drives)
        body.slave.setReal(body.drives, given)
        body.slave.doStep(index * step, step)
        volumes.append(body.slave.getReal(body.volumes)[0])
        clock.append(time.perf_counter())
    controller.close()
    body.close()
    return Outcome(volumes, clock)


def own_loop(folder: Path, scene: scenarios.Scenario) -> Outcome:
    """Run the same two FMUs in the loop of this project."""
    names = ("controller", "body")
    parts = [FmuParticipant(folder / f"resources/{name}.fmu", name) for name in names]
    controller, body = parts
    wires = scenarios.running.assemble.connect(controller, body.ports)
    points = cosimulate(
        parts,
        wires,
        step=scene.coupling.step,
        steps=scene.steps,
        algorithm=scene.coupling.algorithm,
    )
    volumes, clock = [], []
    for point in points:
        volumes.append(point.outputs["body"]["volume"])
        clock.append(time.perf_counter())
    for part in parts:
        part.close()
    return Outcome(volumes, clock)


def fmpy_ssp(ssp: Path, scene: scenarios.Scenario) -> Outcome:
    """Run the master that fmpy brings. It loads and steps in one call, so two lengths are timed."""
    step, seconds = scene.coupling.step, []
    for steps in (0, scene.steps):
        started = time.perf_counter()
        seen = simulate_ssp(str(ssp), stop_time=(steps + 0.5) * step, step_size=step)
        seconds.append(time.perf_counter() - started)
    rest = scenarios.run(scene.changed({"run.cycles": 1}))["volume"].values[:1].tolist()
    return Outcome(rest + seen["body.volume"].tolist()[: scene.steps], seconds)


def ecos(python: str, ssp: Path, scene: scenarios.Scenario, folder: Path) -> Outcome:
    """Ecos, in the environment of its own interpreter."""
    script, output = Path(__file__).with_name("run_ecos.py"), folder / "ecos.json"
    arguments = [ssp, repr(scene.coupling.step), scene.steps, output]
    command = [python, str(script), *map(str, arguments)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return Outcome(**json.loads(output.read_text()))


def cost_of(repeated: list[Outcome]) -> float:
    """Mean time of a step, µs, each step taken where it was shortest."""
    shortest = np.min([np.diff(one.clock) for one in repeated], axis=0)
    return 1e6 * float(shortest.sum()) / (len(repeated[0].volumes) - 1)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ecos", help="Python of an environment with ecospy")
    parser.add_argument("--points", type=int, default=1, help="subdivisions of the sphere")
    options = parser.parse_args()
    changes = {"mesh.icosphere": options.points, "run.cycles": 5}
    scenes = {
        name: scenarios.load("sphere-lung", {**changes, "coupling.algorithm": name})
        for name in ("gauss-seidel", "jacobi")
    }
    truth = {name: scenarios.run(scene)["volume"].values for name, scene in scenes.items()}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ssp = folder / "lung.ssp"
        export_ssp(scenes["jacobi"], ssp)
        with zipfile.ZipFile(ssp) as archive:
            archive.extractall(folder)
        turn, all_at_once = scenes["gauss-seidel"], scenes["jacobi"]
        masters: dict[tuple[str, str], Callable[[], Outcome]] = {
            ("bare fmpy loop", "gauss-seidel"): lambda: bare_loop(folder, turn, in_turn=True),
            ("bare fmpy loop", "jacobi"): lambda: bare_loop(folder, all_at_once, in_turn=False),
            ("softbody's loop", "gauss-seidel"): lambda: own_loop(folder, turn),
            ("softbody's loop", "jacobi"): lambda: own_loop(folder, all_at_once),
            ("fmpy simulate_ssp", "jacobi"): lambda: fmpy_ssp(ssp, all_at_once),
        }
        if options.ecos:
            python = options.ecos
            masters["Ecos", "jacobi"] = lambda: ecos(python, ssp, all_at_once, folder)
        outcomes: dict[tuple[str, str], list[Outcome]] = {key: [] for key in masters}
        for _ in range(REPEATS):
            for key, run in masters.items():
                outcomes[key].append(run())
    print(f"{'master':20}{'algorithm':14}{'largest error':>14}{'µs a step':>11}{'less bare':>11}")
    for (master, algorithm), seen in outcomes.items():
        error = np.max(np.abs(np.array(seen[0].volumes) / truth[algorithm] - 1))
        cost, bare = cost_of(seen), cost_of(outcomes["bare fmpy loop", algorithm])
        print(f"{master:20}{algorithm:14}{error:14.1e}{cost:11.1f}{cost - bare:+11.1f}")


if __name__ == "__main__":
    sys.exit(main())
