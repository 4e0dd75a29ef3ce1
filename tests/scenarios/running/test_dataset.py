from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
import xarray as xr
from scipy.integrate import cumulative_trapezoid

import scenarios
from cosim.controllers import controller_fmu
from scenarios import Scenario
from scenarios.results.files import save

UNITS = {
    "volume": "L",
    "target_volume": "L",
    "bounding_box_volume": "L",
    "bounding_box_min": "m",
    "bounding_box_max": "m",
    "pressure": "cmH2O",
    "alveolar_pressure": "cmH2O",
    "delta_p": "cmH2O",
    "respiratory_pressure": "cmH2O",
    "n": "1",
    "flow": "L/s",
    "phase": "1",
}


@pytest.fixture(scope="module")
def with_positions(small: Scenario) -> xr.Dataset:
    return scenarios.run(small, positions_every=0.5)


def test_the_variables_have_their_units_and_dimensions(sphere: xr.Dataset) -> None:
    assert {name: v.attrs["units"] for name, v in sphere.data_vars.items()} == UNITS
    assert dict(sphere.sizes) == {"time": 121, "axis": 3}
    for name, variable in sphere.data_vars.items():
        with_axis = name in ("bounding_box_min", "bounding_box_max")
        assert variable.dims == (("time", "axis") if with_axis else ("time",))
    assert sphere["time"].attrs["units"] == "s"
    assert sphere["axis"].to_numpy().tolist() == ["x", "y", "z"]


def test_an_output_with_a_name_that_is_taken_gets_another(
    small: Scenario, fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    short = small.changed({"run.period": "0.2 s"})
    dataset = scenarios.run(short, controller=fmu("taken_names"), positions_every=0.1)
    save(dataset, tmp_path / "out.nc")
    for name in ("time", "position", "snapshot_time", "volume"):
        assert (dataset[f"controller_{name}"][1:] == 7.0).all()
    assert float(dataset["volume"][0]) == pytest.approx(2.5, rel=1e-12)
    assert dataset["time"].to_numpy()[-1] == pytest.approx(0.2)
    assert dataset["position"].dims == ("snapshot", "point", "axis")


def test_everything_has_a_long_name(with_positions: xr.Dataset) -> None:
    for variable in with_positions.variables.values():
        assert variable.attrs["long_name"]


def test_the_first_sample_is_the_body_at_rest(sphere: xr.Dataset) -> None:
    first = sphere.isel(time=0)
    assert first["time"] == 0.0
    # The mesh is scaled to 2.5 L by a cube root: a few roundings of its 162 points.
    assert float(first["volume"]) == pytest.approx(2.5, rel=1e-12)
    for name in ("flow", "pressure", "alveolar_pressure", "delta_p", "n"):
        assert first[name] == 0.0


def test_samples_are_at_multiples_of_the_step(small: Scenario, sphere: xr.Dataset) -> None:
    np.testing.assert_array_equal(sphere["time"], np.arange(121) * small.coupling.step)


def test_the_attributes_say_where_the_data_come_from(small: Scenario, sphere: xr.Dataset) -> None:
    said = sphere.attrs
    assert said["scenario"] == small.text
    assert said["controller"] == "paper"
    file = controller_fmu("paper").read_bytes()
    assert said["controller_sha256"] == hashlib.sha256(file).hexdigest()
    assert {"softbody-cosim", "numpy", "scipy", "fmpy"} <= set(json.loads(said["versions"]))
    assert said["integrator"].startswith("SDIRK2(")
    assert isinstance(said["steps"], int)
    assert said["steps"] >= 120  # one for each communication step, or more
    assert 0 < said["wall_time"] < 600
    assert said["status"] == "completed"


def test_the_same_scenario_gives_the_same_bits(small: Scenario, sphere: xr.Dataset) -> None:
    again = scenarios.run(small)
    again.attrs["wall_time"] = sphere.attrs["wall_time"]
    xr.testing.assert_identical(again, sphere)


def test_netcdf_gives_back_everything(with_positions: xr.Dataset, tmp_path: Path) -> None:
    save(with_positions, tmp_path / "out.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "out.nc"), with_positions)


def test_the_scenario_in_the_file_gives_the_same_bits_again(
    sphere: xr.Dataset, tmp_path: Path
) -> None:
    save(sphere, tmp_path / "out.nc")
    again = tmp_path / "again.toml"
    again.write_text(xr.load_dataset(tmp_path / "out.nc").attrs["scenario"])
    xr.testing.assert_equal(scenarios.run(scenarios.load(again)), sphere)


def test_the_airway_takes_its_share_of_the_pressure(sphere: xr.Dataset) -> None:
    # R_aw = 10 cmH2O.s/L. The two pressures are of up to 40 cmH2O, computed in Pa and converted:
    # a few roundings of 40 · 2e-16.
    drop = 10.0 * sphere["flow"]
    np.testing.assert_allclose(
        sphere["alveolar_pressure"], sphere["pressure"] - drop, rtol=0, atol=1e-13
    )


def test_the_gas_and_the_controller_make_the_pressure(sphere: xr.Dataset) -> None:
    # κN/B + ΔP with κ = 2e-3 J, in Pa over 98.0665 Pa/cmH2O; B is that of the same sample.
    gas = 2e-3 * sphere["n"] / (1e-3 * sphere["bounding_box_volume"]) / 98.0665
    np.testing.assert_allclose(sphere["pressure"], gas + sphere["delta_p"], rtol=1e-12, atol=1e-13)


def test_the_bounding_box_is_the_product_of_its_sides(sphere: xr.Dataset) -> None:
    sides = sphere["bounding_box_max"] - sphere["bounding_box_min"]
    np.testing.assert_allclose(1000 * sides.prod("axis"), sphere["bounding_box_volume"], rtol=1e-14)
    assert (sphere["bounding_box_volume"] > sphere["volume"]).all()


def test_flow_adds_up_to_volume(small: Scenario) -> None:
    errors = []
    for rate in (60, 120):
        run = scenarios.run(small.changed({"coupling.step": f"1/{rate} s"}))
        added = cumulative_trapezoid(run["flow"], run["time"], initial=0.0)
        errors.append(float(np.abs(added - (run["volume"] - run["volume"][0])).max()))
    # The flow jumps at the controller's frames, so the trapezoid rule is of first order: jumps of
    # up to 3 L/s times half a step of 1/120 s are 0.013 L each, of either sign.
    assert errors[1] < 0.04
    assert 1.5 < errors[0] / errors[1] < 3


def test_positions_come_with_their_triangles_and_times(with_positions: xr.Dataset) -> None:
    assert with_positions["position"].dims == ("snapshot", "point", "axis")
    assert with_positions["position"].shape == (9, 162, 3)
    assert with_positions["triangles"].dims == ("triangle", "corner")
    assert with_positions["triangles"].shape == (320, 3)
    np.testing.assert_allclose(with_positions["snapshot_time"], np.arange(9) * 0.5, rtol=1e-12)


def test_the_volume_of_the_positions_is_the_volume(with_positions: xr.Dataset) -> None:
    at = with_positions["volume"].sel(time=with_positions["snapshot_time"], method="nearest")
    triangles = with_positions["triangles"].to_numpy()
    for points, volume in zip(with_positions["position"].to_numpy(), at.to_numpy(), strict=True):
        surface = trimesh.Trimesh(points, triangles, process=False)
        # Both sum signed tetrahedra of one closed surface; trimesh takes them about the origin.
        assert 1000 * surface.volume == pytest.approx(volume, rel=1e-9)


def test_positions_change_nothing_else(with_positions: xr.Dataset, sphere: xr.Dataset) -> None:
    new = ["position", "triangles", "snapshot_time"]
    xr.testing.assert_equal(with_positions.drop_vars(new), sphere)


def test_what_a_controller_lacks_is_left_out(small: Scenario) -> None:
    other = scenarios.run(small.changed({"mesh.icosphere": 1}), "pressure-control")
    assert set(other.data_vars) == set(UNITS) - {"target_volume"}


def test_further_outputs_of_a_controller_are_recorded(
    small: Scenario, fmu: Callable[[str], Path]
) -> None:
    other = scenarios.run(small.changed({"mesh.icosphere": 1}), fmu("tells_more")).isel(time=-1)
    assert other["opening"] == 0.25
    assert other["opening"].attrs == {"units": "1", "long_name": "opening of the valve"}
    # The body has a flow of its own, so the controller's gets another name, in its own unit.
    assert other["controller_flow"] == 30.0
    assert other["controller_flow"].attrs["units"] == "L/min"
    assert other["flow"].attrs["units"] == "L/s"
    assert other["delta_p"] == pytest.approx(1.0, rel=1e-15)  # 98.0665 Pa in cmH2O
