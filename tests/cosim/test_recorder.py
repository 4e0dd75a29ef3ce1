from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from cosim import CommunicationPoint, Recorder, UnitError, Variable
from tests.cosim.helpers import Source

SOURCES = [Source(0.0, "cmH2O", "x"), Source(0.0, "Pa", "y"), Source(0.0, None, "z")]
SINGLE = Variable("pressure", ("x.y",), "Pa", "airway pressure")
BASES = (1.0, 10.0, 100.0)


def recorded(*variables: Variable) -> xr.Dataset:
    """Two points: x is 1 and 2 cmH2O, y is 10 and 20 Pa, z is 100 and 200."""
    recorder = Recorder(SOURCES, variables)
    for i, time in enumerate([5.0, 5.1], start=1):
        outputs = {name: {"y": i * base} for name, base in zip("xyz", BASES, strict=True)}
        recorder.record(CommunicationPoint(i, time, outputs))
    return recorder.dataset()


def test_values_are_converted_to_the_units_of_the_variable() -> None:
    pressure = recorded(SINGLE)["pressure"]
    assert pressure.dims == ("time",)
    assert pressure.values == pytest.approx([98.0665, 196.133], rel=1e-15)  # one product
    assert pressure.attrs == {"units": "Pa", "long_name": "airway pressure"}


@pytest.mark.parametrize(
    ("source", "units", "first"), [("x.y", "cmH2O", 1.0), ("y.y", "Pa", 10.0), ("z.y", "1", 100.0)]
)
def test_without_units_those_of_the_port_stay(source: str, units: str, first: float) -> None:
    as_it_is = recorded(Variable("kept", (source,), None, "as it is"))["kept"]
    assert as_it_is.attrs["units"] == units
    assert as_it_is.values.tolist() == [first, 2 * first]


def test_three_sources_lie_along_an_axis() -> None:
    three = Variable("corner", ("x.y", "y.y", "y.y"), "Pa", "a corner")
    corner = recorded(three)["corner"]
    assert corner.dims == ("time", "axis")
    assert corner.axis.values.tolist() == ["x", "y", "z"]
    assert corner.sel(axis="x").values == pytest.approx([98.0665, 196.133], rel=1e-15)
    assert corner.sel(axis="z").values.tolist() == [10.0, 20.0]


def test_variables_keep_their_own_columns() -> None:
    dataset = recorded(
        Variable("corner", ("x.y", "y.y", "y.y"), None, "a corner"),
        Variable("last", ("y.y",), None, "what comes after three columns"),
    )
    assert dataset["last"].values.tolist() == [10.0, 20.0]


def test_time_is_in_seconds_to_the_bit() -> None:
    time = recorded(SINGLE).time
    assert time.values.tolist() == [5.0, 5.1]
    assert (time.units, time.long_name) == ("s", "simulated time")


def test_further_attributes_are_kept() -> None:
    variable = Variable("p", ("x.y",), "Pa", "airway pressure", {"standard_name": "pressure"})
    assert recorded(variable)["p"].standard_name == "pressure"


def test_nothing_recorded_gives_an_empty_dataset() -> None:
    dataset = Recorder(SOURCES, [SINGLE]).dataset()
    assert dataset["pressure"].shape == (0,)
    assert dataset["pressure"].dtype == np.float64


def test_units_of_another_kind_are_refused() -> None:
    with pytest.raises(UnitError, match="'cmH2O' cannot be converted to 'L'"):
        recorded(Variable("volume", ("x.y",), "L", "no volume"))
