"""Run an exported SSP in Ecos, an independent co-simulation master in C++.

In an environment of its own, from the root of this repository:

    python -m venv ecos
    ecos/bin/pip install ecospy==0.7.2 tbb==2023.2.0 .
    softbody export ssp sphere-lung -o lung.ssp
    ecos/bin/python tools/masters/run_ecos.py lung.ssp 0.03333333333333333 600 lung.json

Writes the body's volume at each communication point, and the clock.
"""

import ctypes
import json
import sys
import time
from pathlib import Path

# Ecos is linked against TBB and does not bring it along.
ctypes.CDLL(str(Path(sys.prefix) / "lib" / "libtbb.so.12"), mode=ctypes.RTLD_GLOBAL)

from ecospy import EcosSimulation  # noqa: E402


def main(ssp: str, step: str, steps: str, output: str) -> None:
    """Step through an SSP and write what came of it."""
    simulation = EcosSimulation(step_size=float(step), ssp_path=ssp)
    simulation.init()
    volumes = [simulation.get_real("body::volume")]
    clock = [time.perf_counter()]
    for _ in range(int(steps)):
        simulation.step()
        volumes.append(simulation.get_real("body::volume"))
        clock.append(time.perf_counter())
    simulation.terminate()
    simulation.free()
    Path(output).write_text(json.dumps({"volumes": volumes, "clock": clock}))


if __name__ == "__main__":
    main(*sys.argv[1:])
