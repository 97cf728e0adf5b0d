"""One flight before every monitor."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import Scenario, StepOutput, Tick
from .monitor import Monitor
from .quantity import QUANTITIES
from .verdict import Verdict, Verdicts

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Column = NDArray[Any]
"""Values of a quantity: shape (rows,), (rows, 3) for a vector, (rows, 4) for a quaternion w x y z."""


def opened(scenario: Scenario | str | os.PathLike[str]) -> Scenario:
    """The scenario itself, the built-in one of that name, or the one in that file."""
    if isinstance(scenario, Scenario):
        return scenario
    if isinstance(scenario, str) and not os.path.exists(scenario):
        return Scenario.builtin(scenario)
    return Scenario.load(scenario)


class Flight(Mapping[str, Column]):
    """A flight that has been flown: a mapping from the name of a quantity to its column.

    `flight["position"]` and `flight.position` are the same array; `QUANTITIES` gives units and meanings.

    Attributes:
        scenario: the scenario that was flown.
        verdicts: the table of guarantees.
    """

    def __init__(
        self, scenario: Scenario, columns: dict[str, Column], verdicts: Verdicts
    ) -> None:
        self.scenario = scenario
        self.verdicts = verdicts
        self._columns = columns

    def __getitem__(self, name: str) -> Column:
        try:
            return self._columns[name]
        except KeyError:
            raise KeyError(self._unknown(name)) from None

    def __getattr__(self, name: str) -> Column:
        try:
            return self.__dict__["_columns"][name]  # type: ignore[no-any-return]
        except KeyError:
            raise AttributeError(self._unknown(name)) from None

    def _unknown(self, name: str) -> str:
        columns = list(self.__dict__.get("_columns", ()))
        near = get_close_matches(name, columns, n=1)
        choice = f"did you mean {near[0]!r}?" if near else "it has " + ", ".join(columns)
        return f"a flight has no quantity {name!r}: {choice}"

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._columns]

    @property
    def passed(self) -> bool:
        """True if every guarantee holds."""
        return self.verdicts.passed

    def to_pandas(self) -> pd.DataFrame:
        """A table with a row per recorded tick, indexed by time (s); needs pandas.

        Components are columns of their own, named as in the traces: `position_x`, `attitude_w`.
        """
        import pandas as pd

        table: dict[str, Column] = {}
        for name, values in self._columns.items():
            suffixes = QUANTITIES[name].suffixes
            if len(suffixes) == 1:
                table[name] = values
            else:
                table.update({name + end: values[:, i] for i, end in enumerate(suffixes)})
        return pd.DataFrame(table).set_index("time")

    def plot(self, *names: str) -> Figure:
        """A figure of the quantities, a panel each; without names an overview. Needs matplotlib."""
        from .figure import overview, panels

        return panels(self, names) if names else overview(self)

    def __repr__(self) -> str:
        result = "every guarantee holds" if self.passed else "a guarantee is VIOLATED"
        rows = len(self["tick"])
        return f"Flight({self.scenario.name!r}, {self.scenario.duration:g} s, {rows} rows, {result})"


Law = Callable[[float, NDArray[np.float32], NDArray[np.float32]], ArrayLike | StepOutput]
"""A controller: from time (s), state (13,) and reference (24,) to thrust (N) and torque (N m, body), (4,)."""

Plant = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], ArrayLike]
"""A vehicle: from state (13,), wrench (4,) and disturbance (6,) to the state one step period later, (13,)."""

Disturbance = Callable[[float, NDArray[np.float64]], ArrayLike]
"""A disturbance: from time (s) and state (13,) to acceleration (m/s^2, world) and torque (N m, body), (6,)."""


def run(
    scenario: Scenario | str | os.PathLike[str],
    *,
    every: int = 1,
    controller: Law | None = None,
    plant: Plant | None = None,
    disturbance: Disturbance | None = None,
    monitors: Sequence[Monitor] = (),
    progress: Callable[[int, int], object] | None = None,
    watch: Callable[[Tick], object] | None = None,
    watch_every: int = 10,
) -> Flight:
    """Flies a scenario before every monitor and keeps its columns in memory.

    Args:
        scenario: a Scenario, the name of a built-in one, or a path.
        every: control ticks per row of the columns; the monitors see every tick.
        controller: `(time, state, reference) -> wrench` in place of the scenario's controller. The monitors
            of the theorems need a law of the paper and are left out.
        plant: `(state, wrench, disturbance) -> state` one step period later, in place of the vehicle. The
            monitors go on to take the vehicle of the scenario for the true one.
        disturbance: `(time, state) -> (acceleration, torque)` in place of the scenario's.
        monitors: monitors beside the built-in ones.
        progress: called with the ticks flown and the ticks in all, every 5,000 ticks.
        watch: called with the first tick and every `watch_every`-th after it while the flight goes on, such as
            a viewer of `gyrfalcon.live`.
        watch_every: control ticks between two calls of `watch`.

    States are position (m), velocity (m/s), attitude w x y z, rate (rad/s, body). A controller receives
    float32, plant and disturbance receive float64. Results must be finite.

    Without callables the flight runs without the interpreter's lock, and KeyboardInterrupt ends it within
    milliseconds. An exception of a callable ends it at its tick.

    Raises:
        ScenarioError: with file, line, key and bound.
    """
    scenario = opened(scenario)
    record = _core.run(
        scenario,
        every=every,
        controller=controller,
        plant=plant,
        disturbance=disturbance,
        monitors=list(monitors),
        progress=progress,
        watch=watch,
        watch_every=watch_every,
    )
    verdicts = Verdicts(Verdict(*row) for row in record.verdicts)
    return Flight(scenario, record.columns, verdicts)
