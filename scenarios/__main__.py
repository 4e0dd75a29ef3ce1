"""The command line: ``softbody``, or ``python -m scenarios``."""

from __future__ import annotations

import sys
from importlib.metadata import version

from cyclopts import App, CycloptsError

from scenarios.commands.controller import controller_app
from scenarios.commands.export import export_app
from scenarios.commands.extremes import extremes_
from scenarios.commands.reproduce import reproduce_
from scenarios.commands.resume import resume_
from scenarios.commands.run import run_
from scenarios.commands.terminal import Terminal
from scenarios.commands.trade import trade_
from scenarios.errors import Interrupted, RunError
from scenarios.scene.catalogue import draft, names
from softbody_core import SoftBodyError

BAD_INPUT, FAILED_RUN, INTERRUPTED = 2, 3, 130

app = App(
    name="softbody",
    help="Soft bodies driven by respiratory controllers.\n\n"
    "Start with `softbody run lung`: five breaths of a lung, as a dataset and a picture.",
    version=version("softbody-cosim"),
    version_flags=["--version"],
)
app.command(controller_app)
app.command(run_, name="run")
app.command(resume_, name="resume")
app.command(trade_, name="trade")
app.command(extremes_, name="extremes")
app.command(reproduce_, name="reproduce")
app.command(export_app)


@app.command(name="list")
def list_() -> None:
    """List the scenarios that ship."""
    terminal = Terminal()
    width = max(map(len, names()))
    for name in names():
        terminal.line(f"{name:{width}}  {draft(name).title}")


def main(arguments: list[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : list of str, optional
        In place of ``sys.argv``.

    Returns
    -------
    int
        0; 2 for bad input; 3 for a run that failed on its way; 130 for one that was interrupted.
    """
    errors = Terminal.of_errors()
    try:
        app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
    except CycloptsError as error:
        errors.error(str(error), "softbody --help tells more")
        return BAD_INPUT
    except RunError as error:
        errors.error(str(error))
        return INTERRUPTED if isinstance(error, Interrupted) else FAILED_RUN
    except SoftBodyError as error:
        errors.error(str(error))
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED
    return 0


if __name__ == "__main__":
    sys.exit(main())
