"""Campaigns: many flights of a scenario, and gains for a vehicle."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _core
from ._core import Scenario
from .progress import Progress, reporter

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa


@dataclass(frozen=True)
class CampaignResult:
    """Results of a campaign, or of a share of one.

    Attributes:
        directory: folder with the table `runs.csv`, the page `report.html` and the definition.
        summary: counts and tightest margins by variant and guarantee, as the program's `--json` prints them.
    """

    directory: Path
    summary: Mapping[str, Any]

    @property
    def passed(self) -> bool:
        """True if no run violated a guarantee."""
        return bool(self.summary["passed"])

    @property
    def evidence(self) -> Mapping[str, Mapping[str, Any]]:
        """By variant: the decision about the demand of `[stop]`, or the probability by `[splitting]`."""
        found = {it["name"]: it.get("evidence") or it.get("rare") for it in self.summary["variants"]}
        return {name: evidence for name, evidence in found.items() if evidence is not None}

    @property
    def table(self) -> Path:
        """The table of runs, CSV: a row per run and variant, or per flight of `[splitting]`; `docs/campaign.md` and
        `docs/campaign-evidence.md` define the columns."""
        flights = self.directory / "flights.csv"
        return flights if flights.exists() else self.directory / "runs.csv"

    def to_arrow(self) -> pa.Table:
        """The table as Arrow; needs pyarrow."""
        from pyarrow import csv

        return csv.read_csv(self.table)

    def to_parquet(self, path: str | os.PathLike[str]) -> Path:
        """Writes the table as Parquet; returns its path. Needs pyarrow."""
        from pyarrow import parquet

        parquet.write_table(self.to_arrow(), os.fspath(path))
        return Path(path)

    def to_pandas(self) -> pd.DataFrame:
        """The table as a data frame; needs pandas."""
        import pandas as pd

        return pd.read_csv(self.table)

    def __repr__(self) -> str:
        counts = [
            f"{it['name']}: {it['held']} held, {it['violated']} violated, {it['refused']} refused"
            for it in self.summary["variants"]
        ]
        return f"CampaignResult({str(self.directory)!r}; {'; '.join(counts)})"


def changes(values: Mapping[str, Any] | None) -> list[str]:
    """Changes by dotted path as the text `path=value` that a campaign takes."""
    return [f"{path}={_core.toml_value(value)}" for path, value in (values or {}).items()]


def definition_of(
    definition: str | os.PathLike[str],
    *,
    set: Mapping[str, Any] | None = None,
    runs: int | None = None,
    first_seed: int | None = None,
) -> _core.Campaign:
    """The campaign of a built-in name, a file, or a TOML text (which has line breaks)."""
    text = os.fspath(definition)
    read = _core.Campaign.parse if "\n" in text else _core.Campaign.open
    return read(text, changes(set), runs, first_seed)


def campaign(
    definition: str | os.PathLike[str],
    *,
    out: str | os.PathLike[str] = "out",
    set: Mapping[str, Any] | None = None,
    runs: int | None = None,
    first_seed: int | None = None,
    shard: str = "1/1",
    threads: int | None = None,
    restart: bool = False,
    progress: Progress | bool | None = None,
) -> CampaignResult:
    """Flies a campaign on all cores; results that are there are continued.

    Args:
        definition: name of a built-in campaign, path of a TOML file, or its text.
        out: folder of results; the campaign gets one below it.
        set: values by dotted path that change in every scenario.
        runs, first_seed: in place of the definition's.
        shard: share of the runs, "i/n"; `merge` joins the shares to the bytes of the whole.
        threads: worker threads, one per core unless given.
        restart: overwrite results instead of continuing them.
        progress: called with the runs that are flown and the runs in all; True shows a bar with rate, time left and
            violations.

    A definition with `[stop]` ends when its demand is decided, one with `[splitting]` estimates a rare violation
    (`docs/campaign-evidence.md`): see `CampaignResult.evidence`.

    KeyboardInterrupt ends it after the runs in the air; the next call continues it.

    Raises:
        ScenarioError: a fault of the definition or of a scenario, with file, line, key and bound.
        CampaignError: a request that does not go together with the campaign or with its results.
        OSError: results cannot be written.
    """
    opened = definition_of(definition, set=set, runs=runs, first_seed=first_seed)
    told = reporter(progress, opened.name)
    summary = opened.fly(out, shard=shard, threads=threads, restart=restart, progress=told)
    return _result(summary)


def merge(
    directories: Sequence[str | os.PathLike[str]], *, out: str | os.PathLike[str] = "out"
) -> CampaignResult:
    """Joins the results of shares, in any order, to the bytes of the campaign in one go.

    Raises:
        CampaignError: shares belong to different campaigns, overlap, or leave a gap.
    """
    return _result(_core.merge_shards(list(directories), out))


def _result(summary: str) -> CampaignResult:
    read = json.loads(summary)
    return CampaignResult(Path(read["directory"]), read)


@dataclass(frozen=True)
class Proposal:
    """Gains for a vehicle, and what they promise.

    Attributes:
        scenario: a complete scenario with the gains, ready to fly.
        report: inequalities, poles, predicted errors and the check as text.
        details: the same as a mapping.
    """

    scenario: Scenario
    report: str
    details: Mapping[str, Any]

    @property
    def passed(self) -> bool:
        """True if every flight of the check kept every guarantee, or no check was flown."""
        return bool(self.details["passed"])

    def __str__(self) -> str:
        return self.report


def tune(
    vehicle: str | os.PathLike[str],
    *,
    position_bandwidth: float | None = None,
    attitude_bandwidth: float | None = None,
    heading_bandwidth: float | None = None,
    damping: float | None = None,
    margin: float | None = None,
    position_range: float | None = None,
    attitude_range: float | None = None,
    phase_margin: float | None = None,
    rate_noise: float | None = None,
    noise_torque_max: float | None = None,
    rotation_slope: float | None = None,
    return_speed: float | None = None,
    rotor_lead: float | None = None,
    steady_acceleration: float | None = None,
    steady_torque: float | None = None,
    check: bool = True,
    progress: Progress | bool | None = None,
) -> Proposal:
    """Proposes gains for a vehicle file or a scenario; `docs/tune.md` derives the method.

    Args:
        vehicle: path of a vehicle file or of a scenario, or the name of a built-in scenario.
        position_bandwidth, attitude_bandwidth, heading_bandwidth: least modulus of the poles (rad/s).
        damping: least damping ratio.
        margin: share of every inequality's headroom that is kept.
        position_range: position error up to which the position loop is about linear (m).
        attitude_range: attitude error up to which the torque suffices (rad).
        phase_margin: least phase margin behind rotors that lag or delay (deg).
        rate_noise: standard deviation of white noise of the body rate at every tick (rad/s).
        noise_torque_max: most torque that this noise may make, root mean square over all axes (N m).
        rotation_slope: slope of the rotational smooth sign at zero, as a multiple of k4.
        return_speed: least speed of return from far away on any axis (m/s).
        rotor_lead: quotient of the rotors' lag and of what the lead of a model of them inside the law leaves.
        steady_acceleration: push along each horizontal axis that lasts, on top of D1 (m/s^2): integral action.
        steady_torque: torque about each axis that lasts, on top of D2 (N m): the same.
        check: fly a small campaign over the corners of the vehicle.
        progress: called with the runs of the check that are flown and the runs in all; True shows a bar.

    Raises:
        ScenarioError: a value that cannot be read or is out of its range.
        InfeasibleError: no gains meet the request.
    """
    scenario, text, details = _core.tune_gains(
        os.fspath(vehicle),
        position_bandwidth=position_bandwidth,
        attitude_bandwidth=attitude_bandwidth,
        heading_bandwidth=heading_bandwidth,
        damping=damping,
        margin=margin,
        position_range=position_range,
        attitude_range=attitude_range,
        phase_margin=phase_margin,
        rate_noise=rate_noise,
        noise_torque_max=noise_torque_max,
        rotation_slope=rotation_slope,
        return_speed=return_speed,
        rotor_lead=rotor_lead,
        steady_acceleration=steady_acceleration,
        steady_torque=steady_torque,
        fly_check=check,
        progress=reporter(progress, "check"),
    )
    return Proposal(Scenario.parse(scenario, "tuned"), text, json.loads(details))
