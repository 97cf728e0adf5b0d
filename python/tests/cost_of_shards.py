"""Cost of a campaign on Ray: processor time and memory against shards and workers, as the rows of docs/how-to/cluster.md.

Processor time repeats on a busy machine, where times of the clock do not. Needs psutil. `python python/tests/cost_of_shards.py --runs 160`
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from typing import Any

import psutil

os.environ["RAY_USAGE_STATS_ENABLED"] = "0"

WORKER = "ray::fly_shard"


class Usage:
    """Processor time (s) and largest memory (bytes) of the processes of Ray on this machine."""

    def __init__(self) -> None:
        self.seconds: dict[int, float] = {}
        self.workers: set[int] = set()
        self.memory = 0

    def look(self, *_: int) -> None:
        """Takes what the processes have used so far."""
        for process in psutil.Process().children(recursive=True):
            try:
                with process.oneshot():
                    used = process.cpu_times()
                    self.seconds[process.pid] = used.user + used.system
                    if process.cmdline()[:1] == [WORKER]:
                        self.workers.add(process.pid)
                        self.memory = max(self.memory, process.memory_full_info().uss)
            except (psutil.NoSuchProcess, psutil.AccessDenied, psutil.ZombieProcess):
                continue


def used(before: Usage, after: Usage, pids: set[int]) -> float:
    """Processor time (s) of these processes between two looks."""
    return sum(after.seconds[pid] - before.seconds.get(pid, 0.0) for pid in pids)


def row(workers: int, shards: int, runs: int, folder: str) -> str:
    """One campaign on the cluster that is open."""
    from gyrfalcon import distributed

    before, during = Usage(), Usage()
    before.look()
    begun, own = time.perf_counter(), time.process_time()
    distributed.campaign("paper-uncertainty", shards=shards, runs=runs, out=folder, progress=during.look)
    during.look()
    elapsed, own = time.perf_counter() - begun, time.process_time() - own
    of_workers = used(before, during, during.workers)
    others = used(before, during, set(during.seconds) - during.workers)
    numbers = [of_workers, others, own, elapsed, runs / elapsed, during.memory / 1e6]
    return f"| {workers} | {shards} | " + " | ".join(f"{number:.1f}" for number in numbers) + " |"


def main() -> None:
    import ray

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=160)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--shards", type=int, nargs="+", default=[2, 8, 32, 128])
    arguments = parser.parse_args()
    print("| workers | shards | workers' processor time [s] | Ray's [s] | the caller's [s] | elapsed [s] | runs/s | memory of a worker [MB] |")
    print("|---|---|---|---|---|---|---|---|")
    leave: Any = ray.shutdown
    for workers in arguments.workers:
        ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False, object_store_memory=10**8)
        with tempfile.TemporaryDirectory() as folder:
            # Workers start and load the package with the first.
            row(workers, workers, workers, f"{folder}/first")
            for shards in arguments.shards:
                print(row(workers, shards, arguments.runs, f"{folder}/{shards}"), flush=True)
        leave()


if __name__ == "__main__":
    main()
