"""What computed a result: libraries, processor, and the BLAS behind NumPy and SciPy.

Other versions, or another processor, may change the last bits of a result.
"""

from __future__ import annotations

import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

import numpy as np  # noqa: F401 - loads its BLAS, which is looked for here
import scipy.linalg  # noqa: F401 - and SciPy's
import threadpoolctl

_PACKAGES: Final = (
    "softbody-cosim",
    "numpy",
    "scipy",
    "trimesh",
    "libigl",
    "fmpy",
    "pythonfmu",
    "pythonfmu3",
    "pint",
    "msgspec",
    "xarray",
    "netCDF4",
)


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries that decide a result, as far as they are there."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:  # of an extra
            continue
    return found


def machine() -> dict[str, str]:
    """Processor, system, and the kernel and threads of each BLAS that is loaded."""
    pools = threadpoolctl.threadpool_info()
    blas = [
        f"{pool['internal_api']} {pool['version']} {pool.get('architecture', '')}".strip()
        + f", {pool['num_threads']} threads"
        for pool in pools
        if pool["user_api"] == "blas"
    ]
    return {
        "processor": _processor(),
        "system": f"{platform.system()} {platform.machine()}",
        "blas": "; ".join(sorted(set(blas))) or "none found",
    }


def _processor() -> str:
    """Name of the processor; Linux alone tells it in a file."""
    info = Path("/proc/cpuinfo")
    if sys.platform == "linux" and info.is_file():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
