"""Campaigns and gains: the bytes of the program, progress, interruption."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import gyrfalcon
import pytest
from gyrfalcon import CampaignError, InfeasibleError, ScenarioError

SHORT = {"duration": 0.2, "guarantees.settle_time": 0.1}
TEXT = """
name = "mine"
description = "Masses."
sampling = "monte_carlo"
runs = 40
scenario = "paper-saturated"

[[vary]]
path = "vehicle.mass"
uniform = { lower = 0.8, upper = 0.9 }
"""


def test_the_table_has_the_bytes_of_the_program_s(program: Path, tmp_path: Path) -> None:
    result = gyrfalcon.campaign("paper-uncertainty", out=tmp_path / "a", set=SHORT, runs=60)
    command = [str(program), "campaign", "paper-uncertainty", "--quiet", "--runs", "60", "--json"]
    for path, value in SHORT.items():
        command += ["--set", f"{path}={value}"]
    output = subprocess.run([*command, "--out", str(tmp_path / "b")], capture_output=True, check=False)
    theirs = tmp_path / "b" / "paper-uncertainty"
    for name in ("runs.csv", "campaign.toml", "report.html"):
        assert (result.directory / name).read_bytes() == (theirs / name).read_bytes(), name
    summary = json.loads(output.stdout)
    assert {**summary, "directory": ""} == {**result.summary, "directory": ""}
    assert output.returncode == (0 if result.passed else 1)


def test_shares_merge_to_the_bytes_of_the_whole(tmp_path: Path) -> None:
    whole = gyrfalcon.campaign(TEXT, out=tmp_path / "whole", set=SHORT)
    shares = [
        gyrfalcon.campaign(TEXT, out=tmp_path, set=SHORT, shard=f"{i}/3", threads=1) for i in (3, 1, 2)
    ]
    merged = gyrfalcon.merge([share.directory for share in shares], out=tmp_path / "merged")
    assert merged.table.read_bytes() == whole.table.read_bytes()
    assert "held" in repr(merged)
    with pytest.raises(CampaignError, match="missing"):
        gyrfalcon.merge([shares[0].directory], out=tmp_path / "gap")
    with pytest.raises(ValueError, match="i/n"):
        gyrfalcon.campaign(TEXT, out=tmp_path, shard="4/3")


def test_the_table_reads_as_data_frame_arrow_and_parquet(tmp_path: Path) -> None:
    from pyarrow import parquet

    result = gyrfalcon.campaign(TEXT, out=tmp_path, set=SHORT)
    frame = result.to_pandas()
    assert len(frame) == 40 and frame["seed"].tolist() == list(range(1, 41))
    assert frame["vehicle.mass"].between(0.8, 0.9).all()
    arrow = result.to_arrow()
    assert arrow.column("vehicle.mass").to_pylist() == frame["vehicle.mass"].tolist()
    path = result.to_parquet(tmp_path / "runs.parquet")
    assert parquet.read_table(path).equals(arrow)


def test_progress_counts_to_the_end_and_results_are_continued(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    gyrfalcon.campaign(TEXT, out=tmp_path, set=SHORT, progress=lambda a, b: seen.append((a, b)))
    assert seen[-1] == (40, 40)
    again: list[tuple[int, int]] = []
    gyrfalcon.campaign(TEXT, out=tmp_path, set=SHORT, progress=lambda a, b: again.append((a, b)))
    assert set(again) <= {(0, 0), (40, 40)} and again[-1] == (40, 40)


def test_an_exception_of_the_progress_ends_the_campaign(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        gyrfalcon.campaign(
            TEXT, out=tmp_path, runs=100_000, set=SHORT, progress=lambda done, total: 1 / 0
        )


def test_an_interrupted_campaign_is_continued_to_the_same_bytes(tmp_path: Path) -> None:
    values = {"duration": 10.0}
    code = (
        "import gyrfalcon, sys\n"
        "def show(done, total):\n"
        "    if done >= 10: print('flying', flush=True)\n"
        "try:\n"
        "    gyrfalcon.campaign(sys.argv[1], out=sys.argv[2], set={'duration': 10.0}, runs=600,\n"
        "                       progress=show)\n"
        "except KeyboardInterrupt: print('interrupted')\n"
    )
    command = [sys.executable, "-c", code, TEXT, str(tmp_path / "a")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "flying\n"
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=30)
    assert rest.endswith("interrupted\n")
    table = tmp_path / "a" / "mine" / "runs.csv"
    rows = table.read_text().count("\n") - 1
    assert 0 < rows < 600
    resumed = gyrfalcon.campaign(TEXT, out=tmp_path / "a", set=values, runs=600)
    whole = gyrfalcon.campaign(TEXT, out=tmp_path / "b", set=values, runs=600)
    assert resumed.table.read_bytes() == whole.table.read_bytes()


def test_a_fault_of_a_definition_names_line_and_key(tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(TEXT.replace("uniform", "unifrom"))
    with pytest.raises(ScenarioError, match="did you mean `uniform`") as caught:
        gyrfalcon.campaign(path)
    assert caught.value.file == str(path) and caught.value.line == 10
    with pytest.raises(ScenarioError, match="did you mean `torque-limits`"):
        gyrfalcon.campaign("torque-limit")
    assert "sensitivity" in gyrfalcon.built_in_campaigns()


def test_gains_are_proposed_and_fly(program: Path, tmp_path: Path) -> None:
    proposal = gyrfalcon.tune("paper-saturated", check=False)
    assert proposal.passed and "Poles at hover" in str(proposal)
    command = [str(program), "tune", "paper-saturated", "--no-check", "--quiet", "--write", "mine.toml"]
    subprocess.run(command, cwd=tmp_path, check=True)
    assert (tmp_path / "mine.toml").read_text() == proposal.scenario.to_toml()
    assert gyrfalcon.run(proposal.scenario, every=1000).passed
    with pytest.raises(InfeasibleError):
        gyrfalcon.tune("paper-saturated", position_bandwidth=50.0, check=False)
    with pytest.raises(ScenarioError, match="margin"):
        gyrfalcon.tune("paper-saturated", margin=2.0, check=False)


def test_the_check_of_gains_can_be_ended() -> None:
    class Enough(Exception):
        pass

    def enough(done: int, total: int) -> None:
        assert total == 0 or total > done
        if done > 2:
            raise Enough

    with pytest.raises(Enough):
        gyrfalcon.tune("paper-saturated", progress=enough)


STOP = """
name = "stop"
description = "Masses."
sampling = "monte_carlo"
runs = 5000
scenario = "paper-saturated"
set = ["duration=0.05", "guarantees.settle_time=0.0", "guarantees.position_error_max=4.0",
       "guarantees.attitude_error_max=3.2", "guarantees.tilt_error_max=3.2", "guarantees.heading_error_max=3.2"]

[stop]
failure_probability = 0.02

[[vary]]
path = "vehicle.mass"
uniform = { lower = 0.75, upper = 0.95 }
"""


def test_a_demand_ends_the_campaign_and_is_the_programs(tmp_path: Path, program: Path) -> None:
    result = gyrfalcon.campaign(STOP, out=tmp_path / "python")
    evidence = result.evidence["paper-saturated"]
    assert result.passed and evidence["decision"] == "demonstrated"
    # 0.98^n <= 0.025.
    assert evidence["runs"] == len(result.to_pandas()) == 183
    (tmp_path / "stop.toml").write_text(STOP)
    command = [str(program), "campaign", "stop.toml", "--quiet", "--out", "program"]
    subprocess.run(command, cwd=tmp_path, check=True)
    table = tmp_path / "program" / "stop" / "runs.csv"
    assert table.read_bytes() == result.table.read_bytes()
    with pytest.raises(CampaignError, match="cannot be shared"):
        gyrfalcon.campaign(STOP, out=tmp_path, shard="1/2")


def test_splitting_estimates_what_is_known_in_closed_form(tmp_path: Path) -> None:
    text = """
name = "rare"
description = "Hover from an offset; 2 (1 - Phi(4.5)) = 6.8e-6 of the starts are more than a metre away."
sampling = "monte_carlo"
runs = 100000
scenario = "hover-gusts"
set = ["duration=0.01", "initial.position=[0.0, 0.0, 5.0]",
       "guarantees.settle_time=0.0", "guarantees.position_error_max=1.0"]
[splitting]
guarantee = "position_error_after_settling"
particles = 20
[[vary]]
path = "initial.position[0]"
normal = { mean = 0.0, deviation = 0.2222222222222222 }
"""
    result = gyrfalcon.campaign(text, out=tmp_path)
    rare = result.evidence["hover-gusts"]
    assert rare["finished"] and rare["lower"] < 6.795e-6 < rare["upper"]
    assert rare["upper"] < 4 * rare["lower"] and rare["flights"] < 60_000
    table = result.to_pandas()
    assert len(table) == rare["flights"] and set(table["walk"]) == {"kept", "left"}


def test_a_bar_shows_statistics(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gyrfalcon.campaign(TEXT, out=tmp_path, set=SHORT, progress=True)
    shown = capsys.readouterr().err
    assert "runs/s" in shown and "violated (below " in shown and shown.endswith("\n")
