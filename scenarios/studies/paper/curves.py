"""Figures 7 and 11: pressure-volume curves, and volumes over five breaths."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scenarios.results.analysis import breaths
from scenarios.results.sigmoid import fit_limb, limbs, sigmoid
from scenarios.studies.paper.scenes import ALPHA, THERMOSTAT, Datasets, weights_of

_DPI: Final = 130
_LIMBS: Final = {"inflation": ("tab:blue", "o"), "deflation": ("tab:red", "s")}
_LINES: Final = {"A": ("tab:red", "-"), "B": ("tab:green", "--"), "C": ("tab:blue", "-.")}
"""Colour, and the mark or line that tells it from the others in grey."""


def pressure_volume(datasets: Datasets, path: Path) -> None:
    """Draw Figure 7: the first breath of the stiff lung, under two readings of the controller."""
    panels = {
        ALPHA["C"]: "gas let out while exhaling (N = 100)",
        THERMOSTAT: "f(P) followed in both phases",
    }
    figure = Figure(figsize=(11.5, 5.2), layout="constrained")
    figure.suptitle("Figure 7: sigmoids, and the simulated loop of a lung (α = 3)", fontsize=11)
    for axes, (scene, title) in zip(
        figure.subplots(1, 2, sharey=True), panels.items(), strict=True
    ):
        fits = [_draw_limb(axes, name, limb) for name, limb in limbs(datasets[scene]).items()]
        axes.set_xlabel("\n".join(["respiratory pressure P (cmH2O)", "", *fits]), fontsize=7.5)
        axes.set_title(title, fontsize=10)
        axes.set_ylabel("volume (L)")
        axes.legend(fontsize=8, frameon=False, loc="upper left")
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=_DPI)


def _draw_limb(axes: Axes, name: str, limb: xr.Dataset) -> str:
    """Draw a limb, its target and its fit; return what the fit says."""
    colour, mark = _LIMBS[name]
    pressure = limb["respiratory_pressure"].to_numpy()
    fit = fit_limb(limb)
    dense = np.linspace(pressure.min(), pressure.max(), 200)
    axes.plot(pressure, limb["target_volume"], ":", color=colour, label=f"{name}: f(P)")
    axes.plot(pressure[::2], limb["volume"][::2], mark, color=colour, ms=3, label="simulated")
    axes.plot(dense, sigmoid(dense, **fit.values), color=colour, lw=1, label="fit")
    numbers = ", ".join(f"{k} = {fit.values[k]:.2f} ± {fit.errors[k]:.2f}" for k in fit.values)
    unknown = "" if fit.has_inflection else "; c at its bound"
    return f"{name}: {numbers}; R² = {fit.r_squared:.4f}{unknown}"


def volumes(datasets: Datasets, path: Path) -> None:
    """Draw Figure 11: the volume over five breaths for three α."""
    figure = Figure(figsize=(9, 4.2), layout="constrained")
    axes = figure.subplots()
    for letter, scene in ALPHA.items():
        dataset = datasets[scene]
        colour, line = _LINES[letter]
        label = f"{letter}: α = {weights_of(dataset).alpha:g}"
        axes.plot(dataset["time"], dataset["volume"], line, color=colour, label=label)
        breath_volumes = breaths(dataset)
        ends = breath_volumes["start"] + breath_volumes["duration"]
        axes.plot(ends, breath_volumes["end_expiratory_volume"], "o", color=colour, ms=4)
    rest = float(datasets[ALPHA["A"]]["volume"][0])
    axes.axhline(rest, color="0.6", lw=0.8)
    axes.annotate("rest", (10, rest), xytext=(0, 3), textcoords="offset points", fontsize=8)
    axes.set(xlabel="time (s)", ylabel="volume (L)")
    axes.margins(x=0.01)
    axes.set_title("Figure 11: lung volume; dots mark the end of each exhalation", fontsize=11)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, -0.28), ncols=3, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=_DPI)
