"""The terminal: the one place that prints, and shows how far something has come."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console, RenderableType
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from scenarios.running.progress import Counted

Show = Callable[[Counted], None]


class Terminal:
    """What a command says.

    Parameters
    ----------
    quiet : bool
        Print nothing.
    console : Console, optional
        Where to, if not to standard output.
    """

    def __init__(self, *, quiet: bool = False, console: Console | None = None) -> None:
        self._console = console if console is not None else Console(quiet=quiet)

    @classmethod
    def of_errors(cls) -> Terminal:
        """Print to standard error."""
        return cls(console=Console(stderr=True))

    def line(self, text: str, *, label: str = "", style: str = "") -> None:
        """Print a line as it is, after a label in a style; the terminal wraps it."""
        labelled = Text.assemble((label, style), f"{': ' if label else ''}{text}")
        self._console.print(labelled, soft_wrap=True)

    def error(self, text: str, *hints: str) -> None:
        """Print what went wrong, in red, and below it what to try; words are not broken."""
        self._console.print(f"error: {text}", style="red", markup=False, highlight=False)
        for hint in hints:
            self._console.print(hint, markup=False, highlight=False)

    def show(self, table: RenderableType) -> None:
        """Print a table."""
        self._console.print(table)

    @contextmanager
    def run_bar(self) -> Iterator[Show]:
        """Show simulated time and speed while a run goes on."""
        with self._bar(
            TextColumn("{task.fields[at].time:6.2f} of {task.total:.2f} s simulated"),
            TextColumn("{task.fields[at].speed:5.1f} × real time"),
            TimeRemainingColumn(),
        ) as show:
            yield show

    @contextmanager
    def study_bar(self, part: str = "", *, transient: bool = False) -> Iterator[Show]:
        """Show what goes on, and where there are parts, such as "run", which of how many it is."""
        counter = f"{part} {{task.fields[at].part}} of {{task.total}}" if part else ""
        with self._bar(
            *([TextColumn(counter)] if part else []),
            TimeElapsedColumn(),
            TextColumn("{task.fields[at].name}", markup=False),
            transient=transient,
        ) as show:
            yield show

    @contextmanager
    def _bar(self, *columns: ProgressColumn, transient: bool = False) -> Iterator[Show]:
        bar = Progress(
            BarColumn(bar_width=30),
            *columns,
            console=self._console,
            disable=self._console.quiet,
            transient=transient,
        )
        with bar:
            task = bar.add_task("", total=None, visible=False)

            def show(at: Counted) -> None:
                bar.update(task, total=at.total, completed=at.done, at=at, visible=True)

            yield show
