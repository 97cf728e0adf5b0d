"""Exceptions of the package."""

from __future__ import annotations


class GyrfalconError(Exception):
    """Any error of this package."""


class ScenarioError(GyrfalconError, ValueError):
    """Fault of a scenario or of a campaign's definition: place, key and bound.

    Attributes:
        file: path of the file, or name of the built-in scenario; None for a change.
        line: line in it, counted from one; None if it belongs to no line.
        key: dotted path of the key at fault; None if it belongs to none.
        bound: the violated bound, as in "positive" or "in [0, 180] deg"; None for other faults.
        change: the change at fault, as in "vehicle.mass=-1.0"; None for a file.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        line: int | None = None,
        key: str | None = None,
        bound: str | None = None,
        change: str | None = None,
    ) -> None:
        super().__init__(message)
        self.file = file
        self.line = line
        self.key = key
        self.bound = bound
        self.change = change


class ConfigError(GyrfalconError, ValueError):
    """A parameter of a controller outside the set in which the guarantees hold.

    Attributes:
        parameter: its name, or the expression of several.
        value: its value.
        bound: the violated bound.
        source: origin of the bound: an equation, or the reason in a few words.
    """

    def __init__(
        self,
        message: str,
        *,
        parameter: str = "",
        value: float = float("nan"),
        bound: str = "",
        source: str = "",
    ) -> None:
        super().__init__(message)
        self.parameter = parameter
        self.value = value
        self.bound = bound
        self.source = source


class CampaignError(GyrfalconError):
    """A request that does not go together with a campaign, or results that are not what they should be."""


class InfeasibleError(GyrfalconError, ValueError):
    """No gains meet a request; the message names the condition that stands in the way."""
