"""The Python that the pages print runs as it is printed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "docs" / "contact.md"]
"""Those whose blocks stand alone: others read the file of a long run, or take minutes."""
FENCED = re.compile(r"```python\n(.*?)```", re.DOTALL)
BLOCKS = [
    pytest.param(code, id=f"{page.name}-{number}")
    for page in PAGES
    for number, code in enumerate(FENCED.findall(page.read_text("utf-8")))
]


@pytest.mark.parametrize("code", BLOCKS)
def test_python_on_a_page_runs(code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = code.replace('load("lung"', 'load("sphere-lung"')  # the same calls, on a quick scene
    exec(compile(code, "page", "exec"), {"__name__": __name__})  # noqa: S102 - our own pages
