"""Verdicts of the monitors of a flight."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Verdict:
    """Verdict on one guarantee over a flight, against the vehicle's true state.

    Attributes:
        name: the guaranteed quantity.
        equation: its equation in the paper, or the place of its derivation.
        lower, upper: the bounds that apply; None where there is none.
        observed: the value closest to the bound, or furthest beyond it; None if never observed.
        margin: distance of `observed` from the bound, positive on the good side.
        unit: unit of bounds, `observed` and `margin`.
        time: time of `observed` (s).
        passed: True if the guarantee holds; rows without bounds always pass.
    """

    name: str
    equation: str
    lower: float | None
    upper: float | None
    observed: float | None
    margin: float | None
    unit: str
    time: float | None
    passed: bool

    @property
    def bound(self) -> str:
        """The bounds as text."""
        if self.lower is not None and self.upper is not None:
            return f"[{self.lower:.5g}, {self.upper:.5g}]"
        if self.lower is not None:
            return f">= {self.lower:.5g}"
        return "-" if self.upper is None else f"<= {self.upper:.5g}"

    def __str__(self) -> str:
        result = "pass" if self.passed else "FAIL"
        result = "info" if self.bound == "-" and self.passed else result
        observed = "not observed" if self.observed is None else f"{self.observed:.5g} {self.unit}"
        margin = "" if self.margin is None else f", margin {self.margin:.5g}"
        return f"{result} {self.name} {self.equation}: {observed}, bound {self.bound}{margin}"


class Verdicts(tuple[Verdict, ...]):
    """The table of guarantees of a flight; prints as text, and as a table in a notebook."""

    @property
    def passed(self) -> bool:
        """True if every guarantee holds."""
        return all(verdict.passed for verdict in self)

    def named(self, name: str) -> Verdict:
        """The verdict of this name; KeyError lists the names if there is none."""
        for verdict in self:
            if verdict.name == name:
                return verdict
        raise KeyError(f"no verdict {name!r}: " + ", ".join(verdict.name for verdict in self))

    def __str__(self) -> str:
        return "\n".join(str(verdict) for verdict in self)

    def _repr_html_(self) -> str:
        from html import escape

        def cell(value: object) -> str:
            text = f"{value:.5g}" if isinstance(value, float) else str(value)
            return f"<td>{'-' if value is None else escape(text)}</td>"

        rows = []
        for it in self:
            result = "info" if it.bound == "-" and it.passed else "pass" if it.passed else "FAIL"
            cells = (result, f"{it.name} {it.equation}", it.bound, it.observed, it.margin, it.unit, it.time)
            rows.append("<tr>" + "".join(map(cell, cells)) + "</tr>")
        heads = ("", "guarantee", "bound", "observed", "margin", "unit", "at [s]")
        head = "".join(f"<th>{name}</th>" for name in heads)
        return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
