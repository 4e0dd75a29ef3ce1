from __future__ import annotations

import io

import xarray as xr
from rich.console import Console

from scenarios import Progress, breaths
from scenarios.commands.run_report import show_breaths, show_controller
from scenarios.commands.terminal import Terminal
from scenarios.running.progress import StudyProgress
from scenarios.scene.controller import Controller
from softbody_core import Counters


def _terminal(*, quiet: bool = False) -> tuple[Terminal, io.StringIO]:
    out = io.StringIO()
    return Terminal(console=Console(file=out, width=100, quiet=quiet)), out


def test_the_table_shows_the_numbers_of_the_breaths(sphere: xr.Dataset) -> None:
    terminal, out = _terminal()
    show_breaths(terminal, sphere)
    one = breaths(sphere).isel(breath=0)
    for name in (
        "end_inspiratory_volume",
        "end_expiratory_volume",
        "tidal_volume",
        "residual_volume",
        "duration",
    ):
        assert f" {float(one[name]):.3f} " in out.getvalue()
    assert "rest volume 2.5 L" in out.getvalue()


def test_the_real_time_factor_is_simulated_time_over_wall_time(sphere: xr.Dataset) -> None:
    terminal, out = _terminal()
    show_breaths(terminal, sphere.assign_attrs(wall_time=0.5))
    assert "4 s simulated in 0.5 s (real-time factor 8)" in out.getvalue()


def test_a_run_without_a_breath_says_so(sphere: xr.Dataset) -> None:
    terminal, out = _terminal()
    show_breaths(terminal, sphere.isel(time=slice(0, 10)))
    assert "no complete breath" in out.getvalue()


def test_the_bar_shows_time_and_speed() -> None:
    terminal, out = _terminal()
    with terminal.run_bar() as show:
        show(Progress(time=1.0, duration=4.0, wall_time=0.25, counters=Counters()))
    assert "1.00 of 4.00 s simulated" in out.getvalue()
    assert "4.0 × real time" in out.getvalue()


def test_the_bar_of_a_study_names_what_goes_on_and_counts_the_parts() -> None:
    terminal, out = _terminal()
    with terminal.study_bar("cell") as show:
        show(StudyProgress("dt [0.5]", 2.25, 7))
    assert "cell 3 of 7" in out.getvalue()
    assert "dt [0.5]" in out.getvalue()


def test_a_quiet_console_stays_empty(sphere: xr.Dataset) -> None:
    terminal, out = _terminal(quiet=True)
    with terminal.run_bar() as show:
        show(Progress(time=1.0, duration=4.0, wall_time=0.25, counters=Counters()))
    show_breaths(terminal, sphere)
    assert out.getvalue() == ""


def test_a_period_that_is_not_the_run_s_is_noted() -> None:
    controller = Controller("paper", {"period": "4 s"})
    terminal, out = _terminal()
    show_controller(terminal, controller, 4.0)
    assert "note" not in out.getvalue()
    show_controller(terminal, controller, 3.0)
    assert "the controller's period is 4 s, and run.period 3 s" in out.getvalue()
