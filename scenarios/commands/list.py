"""The command ``softbody list``."""

from __future__ import annotations

from rich.console import Console

from scenarios.scene.shipped import shipped


def list_() -> None:
    """List the scenarios that ship."""
    out, scenarios = Console(), shipped()
    width = max(map(len, scenarios))
    for name in sorted(scenarios):
        out.print(f"{name:{width}}  {scenarios[name].title}", highlight=False)
