"""What the pages print can be typed: every shell line and every Python block, in their order.

Each page is run in a folder of its own. By default the scenes are made small; the slow tests run
everything as it is printed (``pytest -m slow tests/test_docs.py``, about an hour).
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from signal import SIGKILL
from time import sleep
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCED = re.compile(r"^```(sh|python)\n(.*?)^```", re.DOTALL | re.MULTILINE)

BALL = ["--set", "mesh.icosphere=1"]
SMALL = {"lung": ["sphere-lung", *BALL], "sphere-lung": ["sphere-lung", *BALL]}
"""What takes the place of a scene's name to make it quick; ``lung-pair`` is quick enough."""


class Block(NamedTuple):
    """A fenced block: its language, and its text."""

    language: str
    text: str


def blocks(page: Path) -> list[Block]:
    return [Block(*match.groups()) for match in FENCED.finditer(page.read_text("utf-8"))]


PRINTING = [page for page in PAGES if blocks(page)]


def parts(line: str) -> list[list[str]]:
    """Commands that a line joins by ``&&``, as words."""
    words = shlex.split(line, comments=True)
    commands: list[list[str]] = [[]]
    for word in words:
        if word == "&&":
            commands.append([])
        else:
            commands[-1].append(word)
    return [command for command in commands if command]


def is_installation(words: list[str]) -> bool:
    """Whether a command changes an environment: tools/try_installations.py runs those."""
    return words[0].endswith("pip") or words[:3] == ["python", "-m", "venv"] or words == ["pytest"]


def is_long(words: list[str]) -> bool:
    """Whether a command cannot be made small."""
    benchmark = any(word.startswith(("benchmarks/", "tools/")) for word in words)
    return benchmark or words[:2] == ["softbody", "extremes"]


def small(words: list[str]) -> list[str]:
    """A command of the same kind on a small scene, over one breath or less."""
    if words[:2] not in (["softbody", word] for word in ("run", "trade", "reproduce")):
        return words
    command, (scene, *rest) = words[:2], words[2:]
    once = [] if "--cycles" in rest else ["--cycles", "1"]
    if command[1] == "reproduce":
        output = rest[rest.index("-o") :][:2]
        return [*command, "table-2", *output, "--set", LUNG, "--cycles", "1"]
    if scene == "glass-c":
        return [*words, "--set", "run.period=20 ms"]
    if "--checkpoint" in rest:  # it has to go on for long enough to be cut off
        once = ["--cycles", "50"]
    if command[1] == "trade":
        once += ["--set", "run.period=0.2 s", "--limit", "0.5 s"]
    if "points" in rest:
        return [*command, scene, "--axis", "points=12:42", *once]
    return [*command, *SMALL.get(scene, [scene]), *rest, *once]


LUNG = "mesh.lung=lung-right-770"
LOADED = re.compile(r'softbody\.load\("[\w-]*lung"(?:, (\{.*?\}))?\)')
QUICK = {"mesh.icosphere": 1, "run.cycles": 1}


def quick(loading: re.Match[str]) -> str:
    """A scene of Python code, on a small ball and for one breath."""
    changes = loading[1] or "{}"
    return f'softbody.load("sphere-lung", {{**{changes}, **{QUICK}}})'


def environment() -> dict[str, str]:
    """This interpreter's programs first, and its own copy of the package."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return {**os.environ, "PATH": path, "OMP_NUM_THREADS": "1", "COLUMNS": "100"}


def do(words: list[str], folder: Path) -> None:
    """Run a command; it has to end well, or to be cut off as soon as it has a checkpoint."""
    variables = dict(word.split("=", 1) for word in words if re.fullmatch(r"[A-Z_]+=.*", word))
    command = [word for word in words if not re.fullmatch(r"[A-Z_]+=.*", word)]
    if command[0] in ("softbody", "python"):
        command[:1] = [sys.executable, *(["-m", "softbody"] if command[0] == "softbody" else [])]
    with (folder / "log.txt").open("w+") as log:
        process = subprocess.Popen(
            command, cwd=folder, env={**environment(), **variables}, stdout=log, stderr=log
        )
        if "--checkpoint" in words:
            while process.poll() is None and not (folder / "out.checkpoint").exists():
                sleep(0.01)
            process.kill()
        code = process.wait()
        log.seek(0)
        assert code == (-SIGKILL if "--checkpoint" in words else 0), shlex.join(words) + log.read()


def run_page(page: Path, folder: Path, *, as_printed: bool) -> None:
    for name in ("benchmarks", "tools", "tests", "docs"):
        (folder / name).symlink_to(ROOT / name)
    complete, done = True, []
    for block in blocks(page):
        if block.language == "python":
            code = block.text if as_printed else LOADED.sub(quick, block.text)
            if complete or "open_dataset" not in code:
                do(["python", "-c", code], folder)
            continue
        for words in (words for line in block.text.splitlines() for words in parts(line)):
            if is_installation(words):
                continue
            if is_long(words) and not as_printed:
                complete = False
                continue
            command = words if as_printed else small(words)
            if command not in done:  # small, several lines may be the same
                do(command, folder)
                done.append(command)


@pytest.mark.parametrize("page", PRINTING, ids=lambda page: page.name)
def test_what_a_page_prints_runs_on_a_small_scene(page: Path, tmp_path: Path) -> None:
    run_page(page, tmp_path, as_printed=False)


@pytest.mark.slow
@pytest.mark.parametrize("page", PRINTING, ids=lambda page: page.name)
def test_what_a_page_prints_runs_as_it_is_printed(page: Path, tmp_path: Path) -> None:
    run_page(page, tmp_path, as_printed=True)


def test_every_extra_that_a_page_installs_is_there() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    named = {
        extra
        for page in [*PAGES, ROOT / "CONTRIBUTING.md"]
        for line in re.findall(r"pip install [^\n]*", page.read_text("utf-8"))
        for extras in re.findall(r"\[([\w,]+)\]", line)
        for extra in extras.split(",")
    }
    assert named
    assert named <= set(project["optional-dependencies"])
