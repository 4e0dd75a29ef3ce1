"""The command line: ``softbody``, or ``python -m scenarios``."""

from __future__ import annotations

import sys
from importlib.metadata import version

from cyclopts import App, CycloptsError

from scenarios.commands.terminal import Terminal
from scenarios.errors import Interrupted, RunError, SimulationError

BAD_INPUT, FAILED_RUN, INTERRUPTED = 2, 3, 130

COMMANDS = {
    "run": ("run:run_", "Run a scenario; write a dataset and a picture beside it."),
    "list": ("list:list_", "List the scenarios that ship."),
    "controller": ("controller:controller_app", "Respiratory controllers."),
    "resume": ("resume:resume_", "Go on with a run that was cut off, from its last checkpoint."),
    "trade": ("trade:trade_", "Run a grid of settings; write and print what accuracy costs."),
    "extremes": (
        "extremes:extremes_",
        "Map what becomes of a scenario's body at the extremes, under every integrator.",
    ),
    "reproduce": (
        "reproduce:reproduce_",
        "Write the paper's figures and tables, and what becomes of its statements.",
    ),
    "export": ("export:export_app", "Write a body, alone or with its controller, for other tools."),
}
"""Where each command lives, which is imported when it is called, and what it does."""

app = App(
    name="softbody",
    help="Soft bodies driven by respiratory controllers.\n\n"
    "Start with `softbody run lung`: five breaths of a lung, as a dataset and a picture.",
    version=version("softbody-cosim"),
    version_flags=["--version"],
)
for _name, (_place, _help) in COMMANDS.items():
    app.command(f"scenarios.commands.{_place}", name=_name, help=_help)


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
    except SimulationError as error:
        errors.error(str(error))
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED
    return 0


if __name__ == "__main__":
    sys.exit(main())
