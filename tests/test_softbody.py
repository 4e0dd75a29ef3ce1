"""The module `softbody`: one door to all three packages, and to none of their namesakes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import cosim
import scenarios
import softbody
import softbody_core

PACKAGES = (scenarios, cosim, softbody_core)


def run(*arguments: str, path: Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Start Python with a folder in front of what is installed."""
    root = Path(softbody.__file__).parent
    code = f"import sys; sys.path[:0] = [{str(path)!r}, {str(root)!r}]; "
    return subprocess.run(
        [sys.executable, "-c", code + arguments[0], *arguments[1:]],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_every_public_name_is_the_one_of_its_package(package: object) -> None:
    for name in package.__all__:
        assert getattr(softbody, name) is getattr(package, name), name
        assert name in dir(softbody)


def test_no_name_means_two_things() -> None:
    for name in {n for package in PACKAGES for n in package.__all__}:
        things = {id(getattr(p, name)) for p in PACKAGES if name in p.__all__}
        assert len(things) == 1, name


def test_a_star_brings_the_public_names_and_nothing_else() -> None:
    names: dict[str, object] = {}
    exec("from softbody import *", names)  # noqa: S102 - what people type
    del names["__builtins__"]
    assert set(names) == {name for package in PACKAGES for name in package.__all__}


def test_a_name_in_place_of_a_scenario_is_told_how_to_be_loaded() -> None:
    with pytest.raises(softbody.ScenarioError, match=r"softbody\.load\('sphere-lung'\)"):
        softbody.run("sphere-lung")


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = softbody.nothing


@pytest.mark.parametrize("package", ["scenarios", "cosim", "softbody_core"])
def test_a_foreign_package_of_the_same_name_is_named(tmp_path: Path, package: str) -> None:
    foreign = tmp_path / package / "__init__.py"
    foreign.parent.mkdir()
    foreign.write_text("")
    for use in ("softbody.load('lung')", "sys.exit(softbody.main())"):
        done = run(f"import softbody; {use}", "list", path=tmp_path, cwd=tmp_path)
        assert done.returncode != 0
        assert str(foreign) in done.stderr
        assert "rename" in done.stderr
    assert "Traceback" not in done.stderr  # on the command line
    assert done.returncode == 2


def test_a_folder_of_scenario_files_shadows_nothing(tmp_path: Path) -> None:
    """People keep their own scenarios in a folder of that name; it is no package."""
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "mine.toml").write_text("")
    done = run("import softbody; sys.exit(softbody.main())", "list", path=tmp_path, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "sphere-lung" in done.stdout


def test_an_overwritten_package_is_named(tmp_path: Path) -> None:
    """As after installing the foreign package over ours."""
    root = Path(softbody.__file__).parent
    for name in ("softbody.py", "softbody_core", "cosim"):
        (tmp_path / name).symlink_to(root / name)
    copied = tmp_path / "softbody.py"
    copied.unlink()
    copied.write_text(Path(softbody.__file__).read_text(encoding="utf-8"), encoding="utf-8")
    for name in ("softbody_core", "cosim"):
        (tmp_path / name).unlink()
        (tmp_path / name).mkdir()
        for file in ("__init__.py", "__init__.pyi"):
            text = (root / name / file).read_text(encoding="utf-8")
            (tmp_path / name / file).write_text(text, encoding="utf-8")
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "__init__.py").write_text("VALUE = 1\n")
    done = run("import softbody; softbody.load", path=tmp_path, cwd=tmp_path)
    assert "was overwritten by another package of the name 'scenarios'" in done.stderr


def test_help_and_list_import_nothing_heavy() -> None:
    """They start at once: what only a run needs stays out."""
    heavy = ["numpy", "scipy", "xarray", "matplotlib", "trimesh", "pint", "fmpy", "mitsuba"]
    code = (
        "import sys, softbody; sys.argv = ['softbody', *sys.argv[1:]]; softbody.main(); "
        f"sys.stderr.write(','.join(m for m in {heavy} if m in sys.modules))"
    )
    for arguments in (["--help"], ["list"], ["--version"]):
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True
        )
        assert done.stderr == "", arguments


def test_what_the_help_says_of_a_command_is_what_the_command_says() -> None:
    from scenarios.__main__ import COMMANDS, app

    for name, (_, summary) in COMMANDS.items():
        command = app[name]
        said = command.help or command.default_command.__doc__
        assert said.splitlines()[0] == summary, name
