"""The command ``softbody list``."""

from __future__ import annotations

from scenarios.commands.terminal import Terminal
from scenarios.scene.shipped import shipped


def list_() -> None:
    """List the scenarios that ship."""
    terminal, scenarios = Terminal(), shipped()
    width = max(map(len, scenarios))
    for name in sorted(scenarios):
        terminal.line(f"{name:{width}}  {scenarios[name].title}")
