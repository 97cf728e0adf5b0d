"""Figures of a flight, with matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .quantity import QUANTITIES

if TYPE_CHECKING:
    from .flight import Flight

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
"""Distinguishable with any colour vision (Okabe and Ito)."""

ROWS_MAX = 4000
"""Points of a line; more are thinned to the extremes of as many intervals."""


def overview(flight: Flight) -> Figure:
    """Path, errors, thrust, torque and the estimate of the mass at a glance."""
    figure, axes = plt.subplots(2, 3, figsize=(12.5, 6.4), layout="constrained")
    _path(axes[0, 0], flight)
    names = ("position_error", "tilt_error", "thrust", "torque", "mass_estimate")
    for panel, name in zip(axes.flat[1:], names, strict=True):
        draw(panel, flight, name)
    true_mass = flight.scenario.mass
    axes[1, 2].axhline(true_mass, color="0.4", linestyle="--", linewidth=1, label="true mass")
    axes[1, 2].legend(loc="best", frameon=False)
    result = "every guarantee holds" if flight.passed else "a guarantee is violated"
    figure.suptitle(f"{flight.scenario.name}: {result}")
    return figure


def panels(flight: Flight, names: Sequence[str]) -> Figure:
    """A panel per quantity, one below the other."""
    height = 1.0 + 2.3 * len(names)
    figure, axes = plt.subplots(
        len(names), 1, figsize=(8.5, height), sharex=True, squeeze=False, layout="constrained"
    )
    for panel, name in zip(axes.flat, names, strict=True):
        draw(panel, flight, name)
    for panel in axes.flat[:-1]:
        panel.set_xlabel("")
    figure.suptitle(flight.scenario.name)
    return figure


def draw(
    panel: Axes,
    flight: Flight,
    name: str,
    *,
    until: float | None = None,
    label: str | None = None,
    **line: Any,
) -> None:
    """Draws a quantity over time, up to `until` (s), into `panel`; the components of a vector as lines."""
    end = None if until is None else int(np.searchsorted(flight["time"], until))
    times = flight["time"][:end]
    values = flight[name][:end].reshape(len(times), -1)
    quantity = QUANTITIES[name]
    for i, suffix in enumerate(quantity.suffixes):
        time, drawn = thinned(times, values[:, i])
        style: dict[str, Any] = {"color": COLOURS[i % len(COLOURS)], "linewidth": 1.0} | line
        component = suffix.removeprefix("_")
        shown = " ".join(filter(None, (label, component)))
        panel.plot(time, drawn, label=shown or None, **style)
    unit = "" if quantity.unit == "-" else f"  [{quantity.unit}]"
    panel.set_title(name.replace("_", " ") + unit, fontsize=10)
    panel.set_xlabel("time  [s]")
    panel.grid(color="0.9")
    panel.margins(x=0)
    if len(quantity.suffixes) > 1 or label:
        panel.legend(loc="best", frameon=False, ncols=len(quantity.suffixes))


def thinned(time: Any, values: Any) -> tuple[Any, Any]:
    """At most about `ROWS_MAX` points with the same outline: least and largest of each interval."""
    size = len(values)
    if size <= ROWS_MAX:
        return time, values
    count = ROWS_MAX // 2
    edges = np.linspace(0, size, count + 1).astype(int)[:-1]
    least, most = np.minimum.reduceat(values, edges), np.maximum.reduceat(values, edges)
    return np.repeat(time[edges], 2), np.column_stack((least, most)).ravel()


def _path(panel: Axes, flight: Flight) -> None:
    wanted, flown = flight["reference_position"], flight["position"]
    panel.plot(wanted[:, 0], wanted[:, 1], "--", color="0.3", linewidth=1, label="reference", zorder=3)
    panel.plot(flown[:, 0], flown[:, 1], color=COLOURS[0], linewidth=1.2, label="flown")
    panel.set_title("path from above  [m]", fontsize=10)
    panel.set_xlabel("x")
    panel.set_ylabel("y")
    panel.axis("equal")
    panel.grid(color="0.9")
    panel.legend(loc="best", frameon=False)
