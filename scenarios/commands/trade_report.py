"""What the terminal shows of a trade: the Pareto front, and the pick of an integrator."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import numpy as np
import xarray as xr
from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from scenarios.commands.terminal import Terminal
from scenarios.running.run import COMPLETED
from scenarios.studies.accuracy import Pick
from scenarios.studies.trade.pareto import at_most, floor, front
from scenarios.studies.trade.result import is_mesh
from scenarios.studies.trade.settings import in_words, value_text

_HEADINGS = ("error", "end-exp.\n(mL)", "× real\ntime", "force\nevaluations", "linear\nsolves")


def show_pick(terminal: Terminal, picked: Pick, accuracy: float) -> None:
    """Say which integrator was picked, how far off it should be, and how to have it again."""
    table = ", ".join(
        f"{key} = {value!r}" if isinstance(value, float) else f'{key} = "{value}"'
        for key, value in picked.integrator.items()
    )
    if picked.error > accuracy:
        terminal.line(
            f"nothing tried holds {accuracy:g}. A controller that reacts too hard to what "
            "it samples makes small errors large: look at its band, or at the airway's resistance",
            label="warning",
            style="yellow",
        )
    terminal.line(
        f"picked {picked.name}: estimated error {picked.error:.1e} of the volume's range, the "
        f"cheapest good one of {len(picked.tried)} tried on the first breath. The same without "
        f"trying: --set 'integrator = {{{table}}}'"
    )


def show_trade(terminal: Terminal, dataset: xr.Dataset, *, every: bool = False) -> None:
    """Print the Pareto front by cost, or every cell; what failed; how good the reference is.

    Parameters
    ----------
    terminal : Terminal
        Where to.
    dataset : xarray.Dataset
        Of `scenarios.trade`.
    every : bool
        Print the cells off the front too; those on it have a star.
    """
    axes = [str(name) for name in dataset["error"].dims]
    cells = dataset.assign(front=front(dataset), bounded=at_most(dataset))
    rows = cells.to_dataframe().sort_values("wall_time_per_second").reset_index().to_dict("records")
    done = [row for row in rows if row["status"] == COMPLETED]
    shown = [row for row in done if every or row["front"]]
    table = Table(
        title=escape(f"{dataset.attrs['title']}: {'all cells' if every else 'Pareto front'}"),
        caption=f"{len(done)} of {len(rows)} cells have a result, {len(shown)} are shown",
        caption_justify="left",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        show_edge=False,
    )
    table.add_column()
    for name in axes:
        table.add_column(
            name.replace("_", " "), min_width=max(map(len, map(value_text, cells[name].values)))
        )
    for heading in _HEADINGS:
        table.add_column(heading, justify="right")
    for row in shown:
        star = "*" if row["front"] else ""
        table.add_row(
            star, *(value_text(row[name]) for name in axes), *_numbers(row, floor(dataset))
        )
    terminal.show(table)
    for row in rows:
        if row["status"] != COMPLETED:
            setting = in_words({name: row[name] for name in axes})
            terminal.line(f"{setting}: {row['status']}")
    terminal.line(_about_reference(dataset))
    for name in filter(is_mesh, axes):
        terminal.line(_about_meshes(dataset, name))


def _numbers(row: dict[Hashable, Any], smallest: float) -> list[str]:
    error = f"≤ {smallest:.1e}" if row["bounded"] else f"{row['error']:.1e}"
    return [
        error,
        f"{1000 * row['end_expiratory_error']:.2g}",
        f"{1 / row['wall_time_per_second']:.3g}",
        f"{row['force_evaluations']:,.0f}",
        f"{row['linear_solves']:,.0f}",
    ]


def _about_reference(dataset: xr.Dataset) -> str:
    error = dataset.attrs["reference_error"]
    if np.isnan(error):
        return "there is no reference: it was not reached"
    return (
        f"reference: {dataset.attrs['reference']}. Halving its step changes it by {error:.1e}; "
        f"errors below {floor(dataset):.1e} are not told apart"
    )


def _about_meshes(dataset: xr.Dataset, axis: str) -> str:
    sizes, changes = dataset[axis].to_numpy(), dataset[f"{axis}_change"].to_numpy()
    steps = ", ".join(
        f"{change:.1e} from {coarse} to {fine} {axis}"
        for change, coarse, fine in zip(changes[:-1], sizes[:-1], sizes[1:], strict=True)
    )
    order = dataset.attrs.get(f"{axis}_order", np.nan)
    if np.isnan(order):
        return f"change of the converged volume: {steps or 'none'}; an order takes three meshes"
    return f"change of the converged volume: {steps}; order {order:.2f} in the edge length"
