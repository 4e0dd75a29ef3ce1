from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import scenarios
from scenarios import RunError, Scenario
from scenarios.results.plots import overview, save_overview


def _labels(figure: Figure) -> list[str]:
    return [label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel())]


def test_the_axes_say_what_they_show_and_in_which_units(sphere: xr.Dataset) -> None:
    figure = overview(sphere)
    assert isinstance(figure, Figure)
    assert _labels(figure) == [
        "time (s)",
        "volume (L)",
        "respiratory pressure (cmH2O)",
        "volume (L)",
    ]


def test_the_curves_are_the_data(sphere: xr.Dataset) -> None:
    curve, loop = overview(sphere).axes
    volume, target, _ = curve.lines
    np.testing.assert_array_equal(volume.get_ydata(), sphere["volume"])
    np.testing.assert_array_equal(target.get_ydata(), sphere["target_volume"])
    np.testing.assert_array_equal(loop.lines[0].get_xdata(), sphere["respiratory_pressure"])
    np.testing.assert_array_equal(loop.lines[0].get_ydata(), sphere["volume"])
    assert [text.get_text() for text in curve.get_legend().get_texts()] == [
        "volume",
        "target",
        "rest",
    ]


def test_a_controller_without_a_target_is_drawn_too(sphere: xr.Dataset) -> None:
    curve = overview(sphere.drop_vars("target_volume")).axes[0]
    assert [text.get_text() for text in curve.get_legend().get_texts()] == ["volume", "rest"]


def test_a_controller_without_a_pressure_is_drawn_with_that_of_the_body(
    sphere: xr.Dataset,
) -> None:
    figure = overview(sphere.drop_vars("respiratory_pressure"))
    assert _labels(figure)[2] == "alveolar pressure (cmH2O)"


def test_the_title_tells_of_a_run_that_ended_early(sphere: xr.Dataset) -> None:
    assert "ended early" not in overview(sphere).get_suptitle()
    assert "ended early" in overview(sphere.assign_attrs(status="interrupted")).get_suptitle()


def test_a_run_that_failed_at_once_is_drawn(
    small: Scenario, fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    at_once = small.changed({"controller.stuck_valve.at": "0 s"})
    with pytest.raises(RunError) as caught:
        scenarios.run(at_once, fmu("stuck_valve"))
    save_overview(caught.value.dataset, tmp_path / "out.png")  # any warning fails this test
    assert (tmp_path / "out.png").stat().st_size > 0


def test_the_picture_is_not_blank(sphere: xr.Dataset, tmp_path: Path) -> None:
    save_overview(sphere, tmp_path / "out.png")
    picture = matplotlib.image.imread(tmp_path / "out.png")[..., :3]
    inked = np.any(picture < 0.9, axis=2)
    # Two curves and their text on white: a few per cent of the picture, on both halves of it.
    half = inked.shape[1] // 2
    for side in (inked[:, :half], inked[:, half:]):
        assert 0.005 < side.mean() < 0.5
