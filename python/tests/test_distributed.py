"""Campaigns on a Ray cluster of two nodes on this machine, also with a worker killed in mid-shard."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gyrfalcon
import pytest
from gyrfalcon import CampaignError, ScenarioError

os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

NAME = "on-a-cluster"
TEXT = f"""
name = "{NAME}"
description = "Masses."
sampling = "monte_carlo"
runs = 120
scenario = "paper-saturated"
set = ["duration=30.0", "guarantees.settle_time=25.0"]

[[vary]]
path = "vehicle.mass"
uniform = {{ lower = 0.75, upper = 0.95 }}
"""


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two nodes with a core each, on this machine."""
    import ray
    from ray.cluster_utils import Cluster

    size = {"num_cpus": 1, "object_store_memory": 10**8}
    nodes: Any = Cluster(initialize_head=True, head_node_args={**size, "include_dashboard": False})
    nodes.add_node(**size)
    ray.init(address=nodes.address, log_to_driver=False)
    yield nodes
    leave: Any = ray.shutdown
    leave()
    nodes.shutdown()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> gyrfalcon.CampaignResult:
    """The campaign in one process."""
    return gyrfalcon.campaign(TEXT, out=tmp_path_factory.mktemp("whole"))


def same(one: gyrfalcon.CampaignResult, other: gyrfalcon.CampaignResult) -> None:
    for file in ("runs.csv", "campaign.toml", "report.html"):
        assert (one.directory / file).read_bytes() == (other.directory / file).read_bytes(), file


def workers() -> list[int]:
    """Processes below this one that fly a shard."""
    parents: dict[int, int] = {}
    flying = []
    for entry in Path("/proc").iterdir():
        try:
            parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if b"fly_shard" in (entry / "cmdline").read_bytes():
                flying.append(int(entry.name))
        except (ValueError, OSError):
            continue

    def ours(process: int) -> bool:
        while process > 1:
            if process == os.getpid():
                return True
            process = parents.get(process, 0)
        return False

    return [process for process in flying if ours(process)]


def test_a_killed_worker_changes_no_byte(
    cluster: Any, whole: gyrfalcon.CampaignResult, tmp_path: Path
) -> None:
    from gyrfalcon import distributed

    killed: list[int] = []
    seen: list[tuple[int, int]] = []

    def progress(done: int, total: int) -> None:
        seen.append((done, total))
        if not killed and 3 < done < total - 10:
            killed.append(workers()[0])
            os.kill(killed[0], signal.SIGKILL)

    result = distributed.campaign(TEXT, shards=4, out=tmp_path, progress=progress)
    assert killed, "no worker was found to be killed"
    assert not Path(f"/proc/{killed[0]}").exists()
    assert seen[-1] == (120, 120)
    same(result, whole)


def test_shards_in_storage_are_those_that_a_later_call_goes_on_from(
    cluster: Any, whole: gyrfalcon.CampaignResult, tmp_path: Path
) -> None:
    from gyrfalcon import distributed

    storage = tmp_path / "storage"
    first = distributed.campaign(TEXT, shards=3, out=tmp_path / "a", storage=str(storage))
    same(first, whole)
    assert len(list(storage.glob(f"{NAME}.*-of-3/complete.json"))) == 3
    begin = time.monotonic()
    again = distributed.campaign(TEXT, shards=3, out=tmp_path / "b", storage=f"file://{storage}")
    assert time.monotonic() - begin < 5.0, "nothing is flown again"
    same(again, whole)


def test_faults_are_found_before_anything_is_sent() -> None:
    from gyrfalcon import distributed

    with pytest.raises(ScenarioError, match="did you mean `mass`") as caught:
        distributed.campaign(TEXT, shards=2, set={"vehicle.mas": 1.0})
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.key, str(again)) == (caught.value.key, str(caught.value))
    with pytest.raises(ValueError, match="shards = 0"):
        distributed.campaign(TEXT, shards=0)
    with pytest.raises(CampaignError, match="flown on one machine"):
        distributed.campaign(TEXT + "[stop]\nfailure_probability = 0.1\n", shards=2)


def test_the_command_exits_as_documented(
    cluster: Any, whole: gyrfalcon.CampaignResult, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(TEXT)

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "gyrfalcon", "campaign", *words, "--quiet"]
        return subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)

    flown = run(str(path), "--ray", cluster.address, "--shards", "2", "--out", "ray")
    assert flown.returncode == (0 if whole.passed else 1), flown.stderr
    table = (tmp_path / "ray" / NAME / "runs.csv").read_bytes()
    assert table == whole.table.read_bytes()
    violated = run(str(path), "--runs", "2", "--set", "duration=0.2")
    assert violated.returncode == 1 and "2 violated" in violated.stdout
    wrong = run(str(path), "--set", "vehicle.mass=heavy")
    assert wrong.returncode == 2 and "vehicle.mass" in wrong.stderr
    (tmp_path / "file").write_text("")
    assert run(str(path), "--runs", "1", "--out", "file").returncode == 3
