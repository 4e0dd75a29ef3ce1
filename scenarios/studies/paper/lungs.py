"""What section 5 of the paper says: the breathing lung."""

from __future__ import annotations

from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from scenarios.results.analysis import whole_breaths
from scenarios.results.bumpiness import bumpiness
from scenarios.results.sigmoid import fit_limb, limbs
from scenarios.studies.paper.measurement import Measurement, Statement, increasing, listed
from scenarios.studies.paper.scenes import (
    ALPHA,
    BETA,
    THERMOSTAT,
    Datasets,
    weights_of,
)

Array = NDArray[np.float64]

_BACK: Final = 0.05
"""Share of the inhaled volume that may stay inside a lung that is back at its volume: twice the
width of a line in a figure like the paper's."""
_SAME: Final = 0.01
"""Share of the inhaled volume by which breaths that repeat may differ."""
_NEAR: Final = 2.0
"""Distance of a fitted c from the controller's, cmH2O: P moves as far in three frames, and the
flow takes some to follow."""
_FOLLOWS: Final = 0.99
"""R² of a limb that follows a sigmoid. Venegas et al. (1998) had 0.997 for measured curves."""


def kept_shares(dataset: xr.Dataset) -> Array:
    """Share of the volume above rest that is still inside at the end of each breath."""
    volumes = whole_breaths(dataset)
    inhaled = volumes["end_inspiratory_volume"] - float(dataset["volume"][0])
    return np.asarray(volumes["residual_volume"] / inhaled)


def shapes_after_breaths(dataset: xr.Dataset) -> Array:
    """Positions at the end of each exhalation, shape (breath, point, axis), m."""
    volumes = whole_breaths(dataset)
    ends = volumes["start"] + volumes["duration"]
    return dataset["position"].sel(snapshot=_nearest(dataset, ends)).to_numpy()


def bumpiness_after_breaths(dataset: xr.Dataset) -> Array:
    """Bumpiness at the end of each exhalation, less that at rest, in mean edges.

    Then the surface is slack, and the fluid folds it. At the end of an inhalation the gas has
    stretched it smooth, whatever the fluid's weight.
    """
    triangles = dataset["triangles"].to_numpy()
    rest = dataset["position"].to_numpy()[0]
    return np.array([bumpiness(x, triangles, rest) for x in shapes_after_breaths(dataset)])


def _nearest(dataset: xr.Dataset, times: xr.DataArray) -> Array:
    snapshots = dataset["snapshot_time"].to_numpy()
    return np.asarray(np.abs(snapshots - times.to_numpy()[:, None]).argmin(axis=1))


def _pressure_step(datasets: Datasets) -> Measurement:
    dataset = datasets[ALPHA["C"]]
    frames = int(np.sum(dataset["time"] <= float(whole_breaths(dataset)["duration"][0]) + 1e-9)) - 1
    step = float(np.abs(dataset["delta_p"]).max())
    swing = float(dataset["respiratory_pressure"].max())
    return Measurement(
        f"ΔP = {step:.3f} cmH2O = {swing:.0f}/{swing / step:.0f}, the frames of one phase; "
        f"{swing:.0f}/{frames} would swing P by {swing / 2:.0f}",
        bool(np.isclose(step, swing / frames)),
    )


def _molecules(datasets: Datasets) -> Measurement:
    dataset = datasets[ALPHA["C"]].isel(time=slice(1, None))
    inhaling = dataset["phase"] > 0
    most = float(dataset["n"].where(inhaling).max())
    out = np.unique(dataset["n"].where(~inhaling, drop=True))
    return Measurement(
        f"N up to {most:,.0f} while inhaling, {listed(out, ',.0f')} while exhaling",
        most <= 70_000 and out.tolist() == [100.0],
    )


def _capacity(datasets: Datasets) -> Measurement:
    volumes = [2 * float(datasets[scene]["volume"].max()) for scene in ALPHA.values()]
    return Measurement(
        f"two such lungs hold {listed(volumes, '.2f')} L at most (A, B, C)",
        all(4.7 <= volume <= 6.0 for volume in volumes),
    )


def _follows(scene: str, limb: str, centre: float) -> Statement:
    """Return a statement on one limb of Figure 7."""

    def find(datasets: Datasets) -> Measurement:
        fit = fit_limb(limbs(datasets[scene])[limb])
        follows = fit.has_inflection and fit.r_squared >= _FOLLOWS
        unknown = "" if fit.has_inflection else "; c at its bound, so b, c and d are not determined"
        return Measurement(f"{fit}{unknown}", follows and abs(fit.values["c"] - centre) <= _NEAR)

    reading = ", f(P) held in both phases" if scene == THERMOSTAT else ""
    says = f"{limb} follows f(P) with c = {centre:g} cmH2O ({scene}{reading})"
    return Statement("section 5, Figure 7", says, (scene,), find)


def _kept(letter: str, says: str, *, back: bool) -> Statement:
    """Return a statement on whether a lung comes back to its volume."""
    scene = ALPHA[letter]

    def find(datasets: Datasets) -> Measurement:
        shares = kept_shares(datasets[scene])
        volumes = 1000 * whole_breaths(datasets[scene])["residual_volume"].to_numpy()
        return Measurement(
            f"{listed(volumes, '.0f')} mL above rest after each breath, up to {shares.max():.1%} "
            "of what was inhaled",
            bool((shares <= _BACK).all() if back else (shares > _BACK).all()),
        )

    figure = {"A": 8, "B": 9, "C": 10}[letter]
    return Statement(f"section 5.1, Figure {figure}", says, (scene,), find)


def _ordering(datasets: Datasets) -> Measurement:
    above_rest = [
        1000 * whole_breaths(datasets[s])["residual_volume"].to_numpy() for s in ALPHA.values()
    ]
    pairs = [
        f"{letter} {low.min():.0f} to {low.max():.0f}"
        for letter, low in zip(ALPHA, above_rest, strict=True)
    ]
    ordered = [increasing(breath) for breath in zip(*reversed(above_rest), strict=True)]
    return Measurement(
        f"mL above rest: {', '.join(pairs)}; in order in {sum(ordered)} of {len(ordered)} breaths",
        all(ordered),
    )


def _best(datasets: Datasets) -> Measurement:
    last = {letter: kept_shares(datasets[scene])[-1] for letter, scene in ALPHA.items()}
    text = ", ".join(f"{letter} {share:.1%}" for letter, share in last.items())
    return Measurement(
        f"still inside after the last breath: {text}", min(last, key=last.__getitem__) == "C"
    )


def _under_control(datasets: Datasets) -> Measurement:
    dataset = datasets[ALPHA["C"]]
    volumes = whole_breaths(dataset)
    inhaled = float(volumes["tidal_volume"].max())
    spread = max(
        float(np.ptp(volumes[name].to_numpy()))
        for name in ("end_inspiratory_volume", "end_expiratory_volume")
    )
    top, limit = float(dataset["volume"].max()), float(dataset["target_volume"].max())
    return Measurement(
        f"breaths differ by {spread / inhaled:.1%} of the tidal volume; at most {top:.2f} L, where "
        f"f(P) ends at {limit:.2f} L",
        spread <= _SAME * inhaled and top <= limit,
    )


def _bumps(datasets: Datasets) -> Measurement:
    bumps = [bumpiness_after_breaths(datasets[scene]) for scene in BETA.values()]
    text = ", ".join(
        f"β = {weights_of(datasets[scene]).beta:g}: {value[-1]:.4f}"
        for scene, value in zip(BETA.values(), bumps, strict=True)
    )
    rising = [increasing(breath) for breath in zip(*bumps, strict=True)]
    smallest = float(np.diff(bumps, axis=0).min())
    return Measurement(
        f"{text} mean edges above rest at the end of the last breath; strictly rising in "
        f"{sum(rising)} of {len(rising)} breaths, the smallest rise is {smallest:.4f}",
        all(rising),
    )


LUNGS: Final = (
    Statement(
        "section 5",
        "“+ΔP = 40/(number of frames for one respiratory cycle)”",
        (ALPHA["C"],),
        _pressure_step,
    ),
    Statement(
        "section 5",
        "N is at most N_inf = 70k while inhaling, and N_def = 100 while exhaling",
        (ALPHA["C"],),
        _molecules,
    ),
    Statement(
        "section 5",
        "“total lung capacity is about 6 liters of air for human male and 4.7 liters … female”",
        tuple(ALPHA.values()),
        _capacity,
    ),
    _follows(ALPHA["C"], "inflation", 20),
    _follows(ALPHA["C"], "deflation", 10),
    _follows(THERMOSTAT, "deflation", 10),
    _kept("A", "α = 0.25 “does not deform back to the volume at the beginning”", back=False),
    _kept("B", "α = 1 “still maintains some volume at the end of exhalation”", back=False),
    _kept("C", "α = 3 “deforms back to the original volume”", back=True),
    Statement(
        "section 5.1, Figure 10",
        "α = 3 gives “the best result compared to two previous parameter values”",
        tuple(ALPHA.values()),
        _best,
    ),
    Statement(
        "section 5.1, Figure 11",
        "the larger α, the less volume stays, in every cycle",
        tuple(ALPHA.values()),
        _ordering,
    ),
    Statement(
        "section 5.1", "“α = 3 provides a lung volume under control”", (ALPHA["C"],), _under_control
    ),
    Statement(
        "section 5.2, Figure 12",
        "“the bumpiness of the surface is increased when the fluid modeling value is increased”",
        tuple(BETA.values()),
        _bumps,
    ),
)
"""Statements on the lung."""
