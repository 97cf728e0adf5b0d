"""What the tests share. Run by `cargo xtask python`, which builds the program that is compared with."""

from __future__ import annotations

import os
from pathlib import Path

import matplotlib
import pytest

matplotlib.use("Agg")

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def program() -> Path:
    """The program `sil-host`, built by `cargo xtask python`."""
    path = Path(os.environ["GYRFALCON_PROGRAM"])
    assert path.exists(), f"{path}: run `cargo xtask python`"
    return path
