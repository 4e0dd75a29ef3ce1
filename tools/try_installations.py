"""Install the package as a user would, under every interpreter that is here, and see it work.

    python tools/try_installations.py             # every interpreter from 3.11 on, newest libraries
    python tools/try_installations.py --lowest    # and the oldest libraries that pyproject allows
    python tools/try_installations.py --kernels   # the whole suite under other BLAS kernels

Each environment is fresh, outside the tree, and gets a built wheel. In it the first README line's
job is done, and a subset of the tests. A table in Markdown is printed at the end (it goes into
docs/machines.md); interpreters that are missing are named as not tried.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from time import monotonic
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
MINORS = range(11, 16)
SUBSET = (
    "tests/cosim/test_units.py",
    "tests/cosim/test_python_slave.py",
    "tests/cosim/test_fmu.py",
    "tests/core/test_body.py",
    "tests/core/test_mesh.py",
    "tests/scenarios/running",
    "tests/scenarios/results",
    "tests/test_softbody.py",
)
"""What depends on libraries: units, FMUs, netCDF, surfaces, bodies."""

KERNELS = ("Haswell", "SkylakeX", "Zen", "Nehalem")
NEEDS = {"SkylakeX": "avx512f", "Haswell": "avx2", "Zen": "avx2"}
"""What a processor has to be able to do for a kernel of OpenBLAS."""


class Row(NamedTuple):
    """A line of the table."""

    what: str
    libraries: str
    run: str
    tests: str


def main() -> int:
    """Try what is asked for; return 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lowest", action="store_true", help="also the oldest libraries")
    parser.add_argument("--kernels", action="store_true", help="only the suite under BLAS kernels")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="installations-") as name:
        folder = Path(name)
        if options.kernels:
            rows = list(under_kernels())
        else:
            rows = list(under_interpreters(folder, lowest=options.lowest))
    print("\n| what | libraries | `softbody run lung` | tests |\n|---|---|---|---|")
    for row in rows:
        print("| " + " | ".join(row) + " |")
    failed = [row.what for row in rows if "failed" in row.run + row.tests]
    if failed:
        print(f"failed: {', '.join(failed)}")
    return 1 if failed else 0


def under_interpreters(folder: Path, *, lowest: bool) -> Iterator[Row]:
    """Try the wheel under each interpreter; with `lowest`, under the oldest one once more."""
    wheel = build_wheel(folder)
    found = interpreters()
    for minor in MINORS:
        if minor not in found:
            yield Row(f"Python 3.{minor}", "", "not tried: not on this machine", "")
            continue
        yield try_wheel(folder / f"newest-{minor}", found[minor], wheel, lowest=False)
    if lowest:
        yield try_wheel(folder / "lowest", found[min(found)], wheel, lowest=True)


def interpreters() -> dict[int, Path]:
    """Interpreters by minor version: those on PATH, and those of pyenv."""
    candidates = [Path(sys.executable)]
    candidates += [Path(p) for m in MINORS if (p := shutil.which(f"python3.{m}")) is not None]
    candidates += sorted(Path.home().glob(".pyenv/versions/3.*/bin/python"))
    found: dict[int, Path] = {}
    ask = "import sys, ensurepip; print(sys.version_info.minor)"
    for candidate in candidates:
        done = subprocess.run([candidate, "-c", ask], capture_output=True, text=True, check=False)
        if done.returncode == 0 and int(done.stdout) in MINORS:
            found.setdefault(int(done.stdout), candidate)
    return found


def build_wheel(folder: Path) -> Path:
    """Build the wheel of this tree."""
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir"]
    subprocess.run([*pip, folder, ROOT], check=True)
    (wheel,) = folder.glob("*.whl")
    return wheel


def try_wheel(folder: Path, python: Path, wheel: Path, *, lowest: bool) -> Row:
    """Make an environment with a wheel, and use it."""
    version = subprocess.run(
        [python, "-c", "import platform; print(platform.python_version())"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    libraries = "lowest that pyproject.toml allows" if lowest else "newest"
    print(f"Python {version}, libraries: {libraries}", flush=True)
    subprocess.run([python, "-m", "venv", folder / "venv"], check=True)
    own = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
    install(own / "python", wheel, lowest=lowest)
    for name in ("tests", "docs", "benchmarks"):
        shutil.copytree(ROOT / name, folder / name)
    for name in ("README.md", "CONTRIBUTING.md", "pyproject.toml"):
        shutil.copy(ROOT / name, folder)
    run, seconds = attempt([own / "softbody", "run", "lung"], folder)
    made = all((folder / name).stat().st_size > 0 for name in ("out.nc", "out.png")) if run else ""
    # Old libraries warn of what newer ones below them change; for users these are no errors.
    calm = ["-W", "ignore"] if lowest else []
    tests, report = attempt_tests([own / "python", "-m", "pytest", *calm, *SUBSET], folder)
    return Row(
        f"Python {version}",
        libraries,
        f"ok, {seconds:.0f} s" if run and made else "failed",
        report if tests else f"failed: {report}",
    )


def install(python: Path, wheel: Path, *, lowest: bool) -> None:
    """Install a wheel with its test extra: pip takes the newest versions, uv the lowest too."""
    pip = [python, "-m", "pip", "install", "--quiet"]
    if not lowest:
        subprocess.run([*pip, f"{wheel}[test]"], check=True)
        return
    subprocess.run([*pip, "uv"], check=True)
    pins = wheel.with_suffix(".txt")
    uv, project = [python, "-m", "uv", "pip"], ROOT / "pyproject.toml"
    pin = [*uv, "compile", "--quiet", "--extra", "test", "--resolution", "lowest-direct"]
    subprocess.run([*pin, "--output-file", pins, project], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([*uv, "install", "--quiet", "--python", python, "-r", pins], check=True)
    subprocess.run([*pip, "--no-deps", wheel], check=True)


def under_kernels() -> Iterator[Row]:
    """Run the whole suite of the tree under each BLAS kernel, with one thread and with two."""
    for kernel in KERNELS:
        needed = NEEDS.get(kernel)
        if needed is not None and needed not in flags():
            yield Row(f"OpenBLAS {kernel}", "", "", "not tried: this processor cannot run it")
            continue
        for threads in ("1", "2"):
            settings = {"OPENBLAS_CORETYPE": kernel, "OPENBLAS_NUM_THREADS": threads}
            command = [sys.executable, "-m", "pytest"]
            ok, report = attempt_tests(command, ROOT, settings)
            what = f"OpenBLAS {kernel}, {threads} thread{'s' if threads != '1' else ''}"
            yield Row(what, "newest", "", report if ok else f"failed: {report}")


def flags() -> str:
    """What the processor can do, as Linux tells it."""
    info = Path("/proc/cpuinfo")
    return info.read_text(encoding="utf-8") if info.is_file() else platform.processor()


def attempt(command: Sequence[object], folder: Path) -> tuple[bool, float]:
    """Whether a command works, and how long it takes, s."""
    start = monotonic()
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=folder, env=environment, check=False)
    return done.returncode == 0, monotonic() - start


def attempt_tests(
    command: Sequence[object], folder: Path, settings: Mapping[str, str] | None = None
) -> tuple[bool, str]:
    """Whether tests pass, and their closing line; all that they print is shown if they do not."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", **(settings or {})}
    done = subprocess.run(
        [*command, "-q"], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        print(done.stdout[-8000:], done.stderr[-2000:], flush=True)
    lines = done.stdout.strip().splitlines()
    closing = lines[-1].strip("= ") if lines else "no test ran"
    print(f"  {closing}", flush=True)
    return done.returncode == 0, closing


if __name__ == "__main__":
    sys.exit(main())
