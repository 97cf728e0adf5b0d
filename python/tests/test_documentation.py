"""The Python blocks of README and `docs/` that use the package, page by page in order."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"(<!-- not run:[^\n]*-->\s*\n)?^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(page: Path) -> list[tuple[int, str]]:
    """Line and text of each block to be run."""
    text = page.read_text()
    return [
        (text[: match.start(2)].count("\n") + 1, match[2])
        for match in BLOCK.finditer(text)
        if not match[1]
    ]


PAGES = [
    page
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if any("gyrfalcon" in text for _, text in blocks(page))
]


def test_readme_and_guide_are_among_the_pages() -> None:
    assert {page.name for page in PAGES} >= {"README.md", "python.md"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_blocks_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "documentation"}
    for line, text in blocks(page):
        if "gyrfalcon" in text or "gyrfalcon" in names:
            code = "\n" * (line - 1) + text
            exec(compile(code, str(page), "exec"), names)
