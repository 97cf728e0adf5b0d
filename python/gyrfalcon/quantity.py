"""The table of logged quantities, as the traces and logs of this project have them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from . import _core


@dataclass(frozen=True)
class Quantity:
    """A quantity of a flight.

    Attributes:
        name: unique name; the column of a flight.
        unit: its unit, "-" for none.
        meaning: symbol, equation of the paper, frame.
        topic: topic of the flight logs, or "derived".
        suffixes: endings of the components' names in tables, ("",) for a number.
    """

    name: str
    unit: str
    meaning: str
    topic: str
    suffixes: tuple[str, ...]


QUANTITIES: Final[dict[str, Quantity]] = {
    name: Quantity(name, unit, meaning, topic, tuple(suffixes))
    for name, unit, meaning, topic, suffixes in _core.quantities()
}
"""Every quantity by name."""
