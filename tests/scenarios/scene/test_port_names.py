"""``[controller.ports]``: an FMU with names and units of its own drives a body like any other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import scenarios
from cosim import WiringError
from cosim.matching import PortName
from scenarios import Scenario
from tests.scenarios.conftest import Cli

PORTS = {
    "controller.ports.delta_p": {"variable": "Paw", "unit": "mbar"},
    "controller.ports.volume": {"variable": "V_lung", "unit": "mL"},
}


def test_names_and_units_of_the_fmu_are_mapped(small: Scenario, fmu: Callable[[str], Path]) -> None:
    mapped = small.changed({"controller.use": str(fmu("other_names")), **PORTS})
    dataset = scenarios.run(mapped)
    plain = scenarios.run(small, controller=fmu("same_names"))
    assert np.ptp(plain["volume"].to_numpy()) > 0.05
    # The same pressures but for the roundings of their conversions.
    np.testing.assert_allclose(dataset["volume"], plain["volume"], rtol=1e-10)
    assert dataset["Paw"].attrs["units"] == "mbar"
    np.testing.assert_allclose(dataset["Paw"] * 1.019716, dataset["pressure"], atol=1e-5)
    assert "delta_p" not in dataset


def test_a_name_alone_keeps_the_unit_of_the_fmu(
    small: Scenario, fmu: Callable[[str], Path]
) -> None:
    changes = {**PORTS, "controller.ports.delta_p": "Paw"}
    mapped = small.changed({"controller.use": str(fmu("other_names")), **changes})
    assert mapped.controller.ports["delta_p"] == PortName("Paw")
    dataset = scenarios.run(mapped)
    assert dataset["Paw"].attrs["units"] == "Pa"
    assert float(dataset["pressure"].max()) < 0.03  # 2.5 Pa, in cmH2O


def test_the_saved_scenario_keeps_the_names(
    cli: Cli, fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    said = cli(
        *("run", "sphere-lung", "--set", "mesh.icosphere=1", "--cycles", "1", "--no-plot"),
        *("--controller", str(fmu("other_names"))),
        *("--set", "controller.ports.delta_p=Paw"),
        *("--set", 'controller.ports.volume={variable = "V_lung", unit = "mL"}'),
    )
    assert (said.code, said.error) == (0, "")
    (tmp_path / "again.toml").write_text(xr.load_dataset(tmp_path / "out.nc").attrs["scenario"])
    again = scenarios.load(tmp_path / "again.toml")
    assert again.controller.ports["volume"] == PortName("V_lung", "mL")


def test_a_controller_that_ships_takes_no_names(small: Scenario) -> None:
    assert small.changed(PORTS).controller.ports == {}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"delta_q": "Paw"}, "controller.ports.delta_q is unknown; did you mean 'delta_p'?"),
        ({"delta_p": 5}, "controller.ports.delta_p = 5: expected a name, or { variable"),
        ({"delta_p": {"unit": "Pa"}}, "controller.ports.delta_p.variable is missing"),
        ({"delta_p": {"variable": "Paw", "units": "Pa"}}, "did you mean 'unit'?"),
        (
            {"delta_p": {"variable": "Paw", "unit": "mL"}},
            "controller.ports.delta_p.unit = 'mL': 'mL' cannot be converted to 'Pa'",
        ),
        ({"volume": {"variable": "V", "unit": "puff"}}, "unit 'puff' is not known"),
    ],
)
def test_a_table_that_is_wrong_is_refused(
    small: Scenario, changes: dict[str, Any], said: str
) -> None:
    with pytest.raises(scenarios.ScenarioError) as caught:
        small.changed({f"controller.ports.{key}": value for key, value in changes.items()})
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"delta_p": "Pow"}, "has no output 'Pow', which controller.ports.delta_p names; did you "),
        ({"delta_p": "V_lung"}, "has no output 'V_lung'"),
        ({"volume": "Paw"}, "has no input 'Paw'"),
        ({"delta_p": "Paw", "volume": "V_lung"}, "controller.V_lung declares no unit"),
    ],
)
def test_a_name_that_the_fmu_does_not_have_is_refused(
    small: Scenario, fmu: Callable[[str], Path], changes: dict[str, Any], said: str
) -> None:
    ports = {f"controller.ports.{key}": value for key, value in changes.items()}
    mapped = small.changed({"controller.use": str(fmu("other_names")), **PORTS, **ports})
    with pytest.raises(WiringError) as caught:
        scenarios.run(mapped)
    assert said in str(caught.value)
