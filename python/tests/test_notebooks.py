"""The notebooks run to their end, and are kept with their figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

nbf: Any = nbformat
FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def test_both_are_there() -> None:
    assert {path.stem for path in NOTEBOOKS} == {"paper-figures", "rotorpy-se3"}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, tmp_path: Path) -> None:
    kept: Any = nbf.read(path, as_version=4)
    figures = [
        output
        for cell in kept.cells
        for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    ]
    assert len(figures) == {"paper-figures": 8, "rotorpy-se3": 2}[path.stem]
    fresh: Any = nbf.from_dict(kept)
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(fresh, timeout=200, kernel_name="python3", resources=resources).execute()
    assert all(cell.execution_count for cell in fresh.cells if cell.cell_type == "code")
