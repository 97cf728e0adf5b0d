"""Progress of campaigns: one bar with statistics, or a function of one's own."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import TextIO

from . import _core

Progress = Callable[[int, int], object]
"""Called with the runs that are flown and the runs in all, a few times a second."""

Report = Callable[[int, int, int], object]
"""Called with the runs that are flown, the runs in all, and those that violated a guarantee."""

WIDTH = 24
"""Characters of the bar."""


class Bar:
    """A line on standard error that is written again and again, on a terminal as in a notebook.

    It shows the share and number of runs flown, the rate, the time left, and how many runs violated a guarantee, with
    the bound of Clopper and Pearson that follows (95 %, one-sided).
    """

    def __init__(self, name: str, file: TextIO | None = None) -> None:
        self._name = name
        self._file = file
        self._begin = time.monotonic()
        self._before: int | None = None
        self._width = 0

    def __call__(self, done: int, total: int, violated: int) -> None:
        if self._before is None:
            self._before = done  # flown by earlier calls
        flown = done - self._before
        elapsed = max(time.monotonic() - self._begin, 1e-9)
        filled = WIDTH * done // max(total, 1)
        text = f"{self._name} [{'=' * filled}{' ' * (WIDTH - filled)}] {done}/{total} runs"
        if flown > 0:
            rate = flown / elapsed
            text += f", {rate:.1f} runs/s, {(total - done) / rate:.0f} s left"
            bounds = _core.failure_probability(min(violated, flown), flown)
            if bounds is not None:
                text += f", {violated} violated (below {bounds[2]:.1e})"
        end = "\n" if done >= total else ""
        print("\r" + text.ljust(self._width) + end, end="", file=self._file or sys.stderr, flush=True)
        self._width = len(text)


def reporter(progress: Progress | bool | None, name: str) -> Report | None:
    """What is called for the `progress` that a caller asks for: True shows a bar."""
    if progress is None or progress is False:
        return None
    if progress is True:
        return Bar(name)
    return lambda done, total, _: progress(done, total)
