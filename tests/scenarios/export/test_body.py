"""``softbody export fmu``: the body of a scenario for other masters, and for nobody else's risk."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import fmpy
import numpy as np
import pytest
import trimesh
import xarray as xr
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu

import scenarios
from cosim import (
    Causality,
    FmuError,
    FmuParticipant,
    Participant,
    SoftBodyParticipant,
    cosimulate,
)
from cosim.controllers import controller_fmu
from cosim.fmu.variables import by_type
from cosim.soft_body import body_ports
from scenarios import Scenario
from scenarios.export.body import export_fmu
from scenarios.export.parameters import exported_parameters
from scenarios.running.assemble import build_body, connect
from tests.cosim.helpers import description, rewritten, run_python, variable
from tests.scenarios.conftest import Cli

TINY = {"mesh.icosphere": 1, "run.cycles": 1}
STEP = 1 / 30

Export = Callable[..., Path]

VERSIONS = pytest.mark.parametrize("fmi", [2, 3])


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Export:
    """Export a scenario's body; the same scenario is exported once."""
    folder = tmp_path_factory.mktemp("bodies")
    done: dict[tuple[str, int], Path] = {}

    def exported(scenario: Scenario, fmi: int = 2) -> Path:
        key = scenario.text, fmi
        if key not in done:
            done[key] = folder / f"body-{len(done)}.fmu"
            export_fmu(scenario, done[key], fmi=fmi)
        return done[key]

    return exported


@pytest.fixture(scope="module")
def tiny() -> Scenario:
    """A sphere of 42 points."""
    return scenarios.load("sphere-lung", TINY)


@contextmanager
def running(fmu: Path, parameters: Mapping[str, Any] | None = None) -> Iterator[FmuParticipant]:
    """Run a body's FMU up to the end of its initialization."""
    body = FmuParticipant(fmu, "body", parameters)
    try:
        body.initialize(0.0)
        body.begin()
        yield body
    finally:
        body.close()


@contextmanager
def bare(fmu: Path) -> Iterator[tuple[FMU2Slave, Mapping[str, int]]]:
    """Load an FMU with nothing but fmpy; with its value references."""
    seen = fmpy.read_model_description(str(fmu))
    folder = fmpy.extract(str(fmu))
    slave = FMU2Slave(
        guid=seen.guid,
        unzipDirectory=folder,
        modelIdentifier=seen.coSimulation.modelIdentifier,
        instanceName=fmu.stem,
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    yield slave, {v.name: v.valueReference for v in seen.modelVariables}
    slave.terminate()
    slave.freeInstance()


def onward(body: Participant, first: int) -> list[object]:
    seen: list[object] = []
    for i in range(first, first + 4):
        body.write({"delta_p": 200.0 * i, "n": 30_000.0})
        body.step(i * STEP, STEP)
        seen.append(dict(body.read()))
    return seen


def coupled(body_fmu: Path, scenario: Scenario, **parameters: Any) -> list[float]:
    """Volumes, L, of the exported body under the scenario's controller, in our own loop."""
    assert scenario.controller is not None
    path = controller_fmu(scenario.controller.use)
    controller = FmuParticipant(path, "controller", scenario.controller.parameters)
    body = FmuParticipant(body_fmu, "body", parameters)
    try:
        wires = connect(controller, body.ports)
        points = cosimulate(
            [controller, body], wires, step=scenario.coupling.step, steps=scenario.steps
        )
        return [1e3 * point.outputs["body"]["volume"] for point in points]
    finally:
        controller.close()
        body.close()


@VERSIONS
def test_the_exported_body_moves_as_the_run_does(
    export: Export, small: Scenario, sphere: xr.Dataset, fmi: int
) -> None:
    # The same code on the same numbers: equal to the bit.
    assert coupled(export(small, fmi), small) == sphere["volume"].values.tolist()


def test_a_bare_loop_of_fmpy_gives_the_volumes_of_the_run(
    export: Export, small: Scenario, sphere: xr.Dataset
) -> None:
    volumes = []
    with bare(controller_fmu("paper")) as (paper, of), bare(export(small)) as (body, at):
        volumes.append(body.getReal([at["volume"]])[0])
        for index in range(small.steps):
            seen = body.getReal([at["volume"], at["bounding_box_volume"]])
            paper.setReal([of["volume"], of["bounding_box_volume"]], [1e3 * v for v in seen])
            paper.doStep(index * STEP, STEP)
            delta_p, n = paper.getReal([of["delta_p"], of["n"]])
            body.setReal([at["delta_p"], at["n"]], [98.0665 * delta_p, n])
            body.doStep(index * STEP, STEP)
            volumes.append(body.getReal([at["volume"]])[0])
    # Units are converted here in other words than in a run, so the last bits may differ.
    np.testing.assert_allclose(1e3 * np.array(volumes), sphere["volume"], rtol=1e-12)


@pytest.mark.slow
def test_a_process_that_knows_only_fmpy_runs_it(export: Export, tiny: Scenario) -> None:
    code = (
        "import sys\n"
        "from fmpy import simulate_fmu\n"
        "assert not {'pythonfmu', 'cosim'} & set(sys.modules)\n"
        "seen = simulate_fmu(sys.argv[1], output=['volume'], start_values={'delta_p': 300.0})\n"
        "print(len(seen), seen['volume'][0], seen['volume'][-1])"
    )
    done = run_python(code, export(tiny))
    assert done.returncode == 0, done.stderr
    count, first, last = map(float, done.stdout.split())
    assert count == tiny.steps + 1
    assert first == pytest.approx(2.5e-3, rel=1e-12)  # the rest volume, up to rounding
    with running(export(tiny)) as body:
        for index in range(tiny.steps):
            body.write({"delta_p": 300.0})
            body.step(index * STEP, STEP)
        # fmpy adds its steps up, so their lengths differ in the last bits.
        assert last == pytest.approx(body.read()["volume"], rel=1e-9)
    assert last > 1.05 * first


@pytest.mark.slow
@VERSIONS
def test_each_parameter_changes_the_body_as_set_does(
    export: Export, tiny: Scenario, fmi: int
) -> None:
    fmu = export(tiny, fmi)
    parameters = exported_parameters(tiny)
    assert len(parameters) > 10
    for one in parameters:
        assert one.start is not None
        value = one.start + 1 if isinstance(one.start, int) else 1.25 * one.start
        text = value if one.unit in (None, "1") else f"{value!r} {one.unit}"
        changed = SoftBodyParticipant(build_body(tiny.changed({one.name: text})))
        with running(fmu, {one.name: text}) as body:
            assert onward(body, 0) == onward(changed, 0), one.name


def test_a_parameter_decides_what_is_seen_before_the_first_step(
    export: Export, tiny: Scenario
) -> None:
    body = FmuParticipant(export(tiny), "body", {"mesh.volume": "3 L"})
    try:
        body.initialize(0.0)
        assert body.read()["volume"] == pytest.approx(3e-3, rel=1e-12)
    finally:
        body.close()


@VERSIONS
def test_saving_and_restoring_is_exact(export: Export, tiny: Scenario, fmi: int) -> None:
    fmu = export(tiny, fmi)
    with running(fmu, {"forces.alpha": 0.5}) as body, running(fmu) as other:
        assert (body.can_get_and_set_state, body.can_serialize_state) == (True, True)
        onward(body, 0)
        saved, dumped, seen = body.get_state(), body.serialize(), dict(body.read())
        expected = onward(body, 4)
        for _ in range(2):
            body.set_state(saved)
            assert dict(body.read()) == seen
            assert onward(body, 4) == expected
        body.free_state(saved)
        other.deserialize(dumped)  # its own parameters give way to those of the state
        assert onward(other, 4) == expected


def test_a_state_from_before_the_first_step_can_be_restored(export: Export, tiny: Scenario) -> None:
    with running(export(tiny)) as body:
        saved = body.get_state()
        expected = onward(body, 0)
        body.set_state(saved)
        assert onward(body, 0) == expected


def test_two_instances_have_nothing_in_common(export: Export, tiny: Scenario) -> None:
    fmu = export(tiny)
    with running(fmu) as alone:
        soft = onward(alone, 0)
    with running(fmu) as one, running(fmu, {"forces.alpha": 3.0}) as other:
        stiff = [onward(other, 0), onward(one, 0)]
    assert stiff[1] == soft
    assert stiff[0] != soft


def test_ports_bear_the_units_of_the_body(export: Export, tiny: Scenario) -> None:
    with running(export(tiny)) as body:
        assert set(body.ports) == set(body_ports())
        for name, own in body_ports().items():
            assert body.ports[name].causality is own.causality
            assert body.ports[name].unit == own.unit


def test_the_description_of_fmi_3_is_complete_and_true(export: Export, tiny: Scenario) -> None:
    fmu = export(tiny, 3)
    assert validate_fmu(str(fmu)) == []
    root = description(fmu)
    flags = root.find("CoSimulation")
    assert flags is not None
    said = {flag: flags.get(flag) for flag in flags.attrib if flag.startswith(("can", "needs"))}
    assert said == {
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "canHandleVariableCommunicationStepSize": "true",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "needsExecutionTool": "true",
    }
    for one in exported_parameters(tiny):
        assert float(variable(root, one.name).get("start", "nan")) == one.start
        assert variable(root, one.name).get("unit") == one.unit
    outputs = root.findall("ModelStructure/Output")
    unknowns = root.findall("ModelStructure/InitialUnknown")
    assert len(outputs) == len(unknowns) == len(body_ports()) - 2
    assert {output.get("dependencies") for output in outputs} == {""}


def test_the_description_is_complete_and_true(export: Export, tiny: Scenario) -> None:
    fmu = export(tiny)
    assert validate_fmu(str(fmu)) == []
    root = description(fmu)
    flags = root.find("CoSimulation")
    assert flags is not None
    expected = {
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "canHandleVariableCommunicationStepSize": "true",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "needsExecutionTool": "true",  # the package has to be installed
    }
    assert {name: flags.get(name) for name in expected} == expected
    for one in exported_parameters(tiny):
        number = variable(root, one.name)[0]
        assert float(number.get("start", "nan")) == one.start  # to the bit
        assert number.get("min") is not None
        assert variable(root, one.name).get("description")
    pressures = root.find("UnitDefinitions/Unit[@name='Pa']/DisplayUnit")
    assert pressures is not None
    assert pressures.get("name") == "cmH2O"
    assert float(pressures.get("factor", "nan")) == pytest.approx(1 / 98.0665, rel=1e-15)
    # No output follows an input at once: a master sees no algebraic loop.
    assert {unknown.get("dependencies") for unknown in root.iter("Unknown")} >= {""}
    outputs = root.findall("ModelStructure/Outputs/Unknown")
    assert len(outputs) == sum(p.causality is Causality.OUTPUT for p in body_ports().values())
    assert {unknown.get("dependencies") for unknown in outputs} == {""}


def test_an_export_follows_from_its_content(tmp_path: Path, tiny: Scenario) -> None:
    paths = [tmp_path / f"{name}.fmu" for name in ("one", "two", "other")]
    for path, scene in zip(paths, [tiny, tiny, tiny.changed({"forces.alpha": 2.0})], strict=True):
        export_fmu(scene, path)
    one, two, other = (path.read_bytes() for path in paths)
    assert one == two
    assert description(paths[0]).get("guid") != description(paths[2]).get("guid")
    assert one != other


def test_surfaces_are_inside(tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    ball = scenarios.load("sphere-lung", TINY)
    for name, subdivisions in (("lung.stl", 1), ("floor.ply", 1)):
        trimesh.creation.icosphere(subdivisions=subdivisions).export(folder / name)
    text = ball.changed(
        {
            "mesh": {"file": "lung.stl", "volume": "2.5 L", "weld": True},
            "obstacles.floor.mesh": {
                "file": "floor.ply",
                "volume": "1 L",
                "position": ["0 m", "0 m", "-0.2 m"],
            },
        }
    ).text
    (folder / "mine.toml").write_text(text)
    scene = scenarios.load(folder / "mine.toml")
    expected = scenarios.run(scene)["volume"].values.tolist()
    fmu = tmp_path / "body.fmu"
    export_fmu(scene, fmu)
    for path in [*folder.iterdir(), folder]:
        path.rmdir() if path.is_dir() else path.unlink()
    assert coupled(fmu, scene) == expected
    with running(fmu) as body:
        assert body.read()["clearance"] > 0
    assert variable(description(fmu), "contact.friction")[0].get("start") == "0.3"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lung", "lung-bending", "sphere-lung-membrane", "glass"])
def test_bodies_of_all_kinds_can_be_exported(export: Export, name: str) -> None:
    points = {"mesh.ball": 42} if name == "glass" else {"mesh.lung": "lung-left-770"}
    scene = scenarios.load(name, TINY if name.startswith("sphere") else points)
    assert validate_fmu(str(export(scene))) == []
    with running(export(scene)) as body:
        body.step(0.0, scene.coupling.step)
        assert body.read()["volume"] > 0


def test_held_inputs_are_where_the_fmu_starts(export: Export) -> None:
    fmu = export(scenarios.load("glass", {"mesh.ball": 42}))
    assert variable(description(fmu), "n")[0].get("start") == "13500.0"


@VERSIONS
def test_a_step_that_fails_is_discarded_and_says_why(
    export: Export, tiny: Scenario, fmi: int
) -> None:
    fmu = export(tiny.changed({"integrator.max_steps": 3, "integrator.tolerance": 1e-9}), fmi)
    with running(fmu) as body:
        before = dict(body.read())
        body.write({"delta_p": 3000.0})
        with pytest.raises(FmuError, match=r"after 3 inner steps") as caught:
            body.step(0.0, 1.0)
        assert "discard" in str(caught.value)
        body.write({"delta_p": 0.0})  # it stands where it stood, and goes on
        body.step(0.0, 1e-6)
        assert body.read()["volume"] == pytest.approx(before["volume"], rel=1e-9)


def test_an_input_that_no_body_takes_is_refused_by_name(export: Export, tiny: Scenario) -> None:
    with running(export(tiny)) as body:
        body.write({"n": -1.0})
        with pytest.raises(FmuError, match=r"n = -1: expected at least 0"):
            body.step(0.0, STEP)


def test_a_parameter_out_of_bounds_is_refused_by_path(
    export: Export, tiny: Scenario, tmp_path: Path
) -> None:
    with pytest.raises(FmuError, match=r"forces\.alpha = 0.*expected at least"):
        FmuParticipant(export(tiny), "body", {"forces.alpha": 0.0})

    def forget_bound(root: ET.Element) -> None:  # as a master that does not look at bounds
        variable(root, "forces.alpha")[0].attrib.pop("min")

    fmu = rewritten(export(tiny), tmp_path / "unbounded.fmu", forget_bound)
    body = FmuParticipant(fmu, "body", {"forces.alpha": 0.0})
    with pytest.raises(FmuError, match=r"forces\.alpha = 0: expected more than 0"):
        body.initialize(0.0)
    body.close()


def test_a_parameter_that_comes_late_stops_the_fmu(export: Export, tiny: Scenario) -> None:
    with bare(export(tiny)) as (body, at):
        body.setReal([at["forces.alpha"]], [1.0])  # no change, no harm
        body.doStep(0.0, STEP)
        body.setReal([at["forces.alpha"]], [2.0])
        with pytest.raises(Exception, match="discard"):
            body.doStep(STEP, STEP)


@VERSIONS
def test_a_state_from_before_a_late_parameter_goes_on(
    export: Export, tiny: Scenario, fmi: int
) -> None:
    parameter = ["forces.alpha"]
    with running(export(tiny, fmi)) as body:
        onward(body, 0)
        saved = body.get_state()
        expected = onward(body, 4)
        body.set_state(saved)
        late = by_type(body._calls, [body._variables[name] for name in parameter])
        late[0].write({"forces.alpha": 2.0})
        spoilt = body.get_state()
        with pytest.raises(FmuError, match=r"forces.alpha = 2.0 came too late"):
            onward(body, 4)
        body.set_state(saved)
        assert onward(body, 4) == expected
        body.set_state(spoilt)  # it is part of what was saved
        with pytest.raises(FmuError, match="too late"):
            onward(body, 4)
        late[0].write({"forces.alpha": 1.0})  # as it was
        assert onward(body, 4) == expected


def with_file(fmu: Path, copy: Path, name: str, edit: Callable[[str], str]) -> Path:
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(copy, "w") as new:
        for item in old.namelist():
            data = old.read(item)
            new.writestr(item, edit(data.decode()).encode() if item == name else data)
    return copy


def test_another_version_of_the_package_is_warned_of(
    export: Export, tiny: Scenario, tmp_path: Path
) -> None:
    def older(text: str) -> str:
        return text.replace('"version": "', '"version": "0.0.')

    fmu = with_file(export(tiny), tmp_path / "old.fmu", "resources/interface.json", older)
    with running(fmu) as body:
        assert "made with softbody-cosim 0.0." in body.log.warnings[0]


def test_a_python_without_the_package_is_told(export: Export, tiny: Scenario) -> None:
    code = (
        "import sys\n"
        "sys.modules['cosim'] = None\n"
        "from fmpy import simulate_fmu\n"
        "simulate_fmu(sys.argv[1], debug_logging=True)"
    )
    done = run_python(code, export(tiny))
    assert done.returncode != 0
    assert "needs the package softbody-cosim" in done.stdout + done.stderr


@pytest.mark.parametrize(
    ("arguments", "fragment"),
    [
        (["sphere-lugn", "-o", "b.fmu"], "no scenario is named 'sphere-lugn'; did you mean"),
        (["sphere-lung", "-o", "b.zip"], "expected a name that ends in .fmu"),
        (["sphere-lung", "-o", "no/b.fmu"], "folder no does not exist"),
        (["sphere-lung", "-o", "b.fmu", "--set", "forces.alpha=0"], "expected more than 0"),
        (["sphere-lung"], "requires an argument"),
    ],
)
def test_mistakes_are_told_in_a_line(cli: Cli, arguments: list[str], fragment: str) -> None:
    said = cli("export", "fmu", *arguments)
    assert said.code == 2
    assert fragment in said.error
    assert "Traceback" not in said.error
    assert not Path("b.fmu").exists()


def test_the_command_says_what_it_wrote(cli: Cli) -> None:
    said = cli("export", "fmu", "sphere-lung", "-o", "b.fmu", "--set", "mesh.icosphere=1")
    assert said.code == 0
    assert said.out == (
        "wrote b.fmu; it runs on linux64 and win64, where Python finds softbody-cosim"
    )
    assert validate_fmu("b.fmu") == []


def test_one_of_several_bodies_is_named(cli: Cli, tiny: Scenario) -> None:
    own = {"left": {"forces": {"alpha": 0.5}}, "right": {"forces": {"alpha": 2.0}}}
    Path("pair.toml").write_text(tiny.changed({"bodies": own}).text)
    for arguments, fragment in (
        (
            [],
            "scenario pair has several bodies, and an FMU holds one; name it, such as --body left",
        ),
        (["--body", "up"], "--body = 'up': known: left, right"),
    ):
        said = cli("export", "fmu", "pair.toml", "-o", "b.fmu", *arguments)
        assert said.code == 2
        assert fragment in said.error
    assert cli("export", "fmu", "pair.toml", "-o", "b.fmu", "--body", "right").code == 0
    with running(Path("b.fmu")) as body:
        right = SoftBodyParticipant(build_body(tiny.changed({"forces.alpha": 2.0})))
        assert onward(body, 0) == onward(right, 0)


def test_the_command_writes_fmi_3_too(cli: Cli) -> None:
    small = ["--set", "mesh.icosphere=1"]
    said = cli("export", "fmu", "sphere-lung", "-o", "b.fmu", "--fmi", "3", *small)
    assert said.code == 0
    assert description(Path("b.fmu")).get("fmiVersion") == "3.0"


def test_fmi_3_needs_a_package(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "cosim.export.fmi3", raising=False)
    monkeypatch.setitem(sys.modules, "pythonfmu3", None)
    said = cli("export", "fmu", "sphere-lung", "-o", "b.fmu", "--fmi", "3")
    assert said.code == 2
    assert "FMI 3.0 needs the package pythonfmu3; install it with: pip install" in said.error


def test_a_machine_without_a_binary_is_noted(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenarios.commands.export.PLATFORM", "darwin64")
    said = cli("export", "fmu", "sphere-lung", "-o", "b.fmu", "--set", "mesh.icosphere=1")
    assert said.code == 0
    assert "note: it does not run on this machine (darwin64)" in said.out
