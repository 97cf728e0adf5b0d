"""A monitor of one's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ._core import Tick


@dataclass(frozen=True)
class Monitor:
    """A number of every control tick that must keep a bound; its verdict joins those of the flight.

    Attributes:
        name: name of the verdict.
        value: the number, from a tick; `tick["position"]` is the value of a quantity of `QUANTITIES`.
        at_least, at_most: the bounds; with neither the largest value is information.
        unit: unit of the number and of its bounds.
        since: time from which on the bounds hold (s).
        source: equation, or the place of the bound's derivation.
    """

    name: str
    value: Callable[[Tick], float]
    at_least: float | None = None
    at_most: float | None = None
    unit: str = "-"
    since: float = 0.0
    source: str = "-"
