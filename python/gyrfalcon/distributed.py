"""Campaigns on a Ray cluster: a task per shard, joined to the bytes of the campaign in one go.

Needs ray. Every worker needs this package and the same version of it.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import ray

from . import _core
from .campaigns import CampaignResult, definition_of, merge
from .errors import CampaignError
from .progress import Progress, Report, reporter

FILES = ("runs.csv", "campaign.toml")
"""Files of a share that the join reads; all others follow from them."""

LOOK = 0.3
"""Time between two looks at the progress (s)."""


class Counter:
    """Number of runs flown per shard, and of those that violated a guarantee; an actor of the cluster."""

    def __init__(self) -> None:
        self._counts: dict[int, tuple[int, int]] = {}

    def report(self, shard: int, done: int, violated: int) -> None:
        """Takes the numbers of a shard."""
        self._counts[shard] = (done, violated)

    def counts(self) -> tuple[int, int]:
        """The numbers of all shards."""
        done, violated = zip(*self._counts.values(), strict=True) if self._counts else ((), ())
        return sum(done), sum(violated)


def fly_shard(
    definition: str, number: int, count: int, threads: int, storage: str | None, counter: Any
) -> dict[str, bytes]:
    """Flies shard `number` of `count` on the node's own disk; its files, or none if they are in `storage`.

    What an earlier try has left on the node or in `storage` is continued.
    """
    campaign = _core.Campaign.parse(definition, [])
    digest = hashlib.sha256(definition.encode()).hexdigest()[:16]
    scratch = Path(tempfile.gettempdir()) / f"gyrfalcon-{digest}"
    name = f"{campaign.name}.{number}-of-{count}" if count > 1 else campaign.name
    folder = scratch / name
    scratch.mkdir(parents=True, exist_ok=True)
    told = -1

    def progress(done: int, total: int, violated: int) -> None:
        nonlocal told
        if done != told:
            told = done
            counter.report.remote(number, done, violated)

    # Nobody else on this node writes there, such as a first try that has not ended yet.
    with (scratch / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if storage is not None and not (folder / FILES[0]).exists():
            _fetch(storage, name, folder)
        campaign.fly(scratch, shard=f"{number}/{count}", threads=threads, progress=progress)
        files = {file: (folder / file).read_bytes() for file in FILES}
        if storage is not None:
            _put(storage, name, files)
        shutil.rmtree(folder)
    return files if storage is None else {}


def campaign(
    definition: str | os.PathLike[str],
    *,
    shards: int,
    address: str | None = None,
    out: str | os.PathLike[str] = "out",
    set: Mapping[str, Any] | None = None,
    runs: int | None = None,
    first_seed: int | None = None,
    threads: int = 1,
    retries: int = 3,
    storage: str | None = None,
    progress: Progress | bool | None = None,
) -> CampaignResult:
    """Flies a campaign on a Ray cluster, a task per shard, and joins the shards below `out`.

    Args:
        definition, set, runs, first_seed: as those of `gyrfalcon.campaign`.
        shards: number of tasks; several times that of the workers evens out their load.
        address: of the cluster, as `ray.init` takes it; None uses the connection that is open, or starts Ray here.
        out: folder of the joined results, on this machine.
        threads: worker threads of a task, and the cores that it asks for.
        retries: how often a task whose worker dies begins again; on the same node it continues its shard.
        storage: folder or fsspec URL that all workers reach, for the files of finished shards, from which a
            later call goes on; without it they come back as bytes.
        progress: called with the runs that are flown and the runs in all; True shows a bar with rate, time left and
            violations in all shards.

    Returns the same bytes as `gyrfalcon.campaign`. KeyboardInterrupt cancels the tasks.

    Raises:
        ScenarioError: a fault of the definition, found before anything is sent.
        CampaignError: the definition has `[stop]` or `[splitting]`, whose runs decide on the next.
        ray.exceptions.RayError: a task failed more than `retries` times.
    """
    if shards < 1 or threads < 1:
        raise ValueError(f"shards = {shards} and threads = {threads} must be at least 1")
    opened = definition_of(definition, set=set, runs=runs, first_seed=first_seed)
    if opened.is_adaptive:
        raise CampaignError("a campaign with [stop] or [splitting] is flown on one machine: use gyrfalcon.campaign")
    shards = min(shards, opened.runs)
    if not ray.is_initialized():
        ray.init(address=address, log_to_driver=False, include_dashboard=None if address else False)
    text = opened.to_toml()
    actor: Any = ray.remote(num_cpus=0)(Counter)
    counter = actor.remote()
    task: Any = ray.remote(num_cpus=threads, max_retries=retries)(fly_shard)
    tasks = [
        task.remote(text, number, shards, threads, storage, counter)
        for number in range(1, shards + 1)
    ]
    try:
        told = reporter(progress, opened.name)
        _wait(tasks, lambda: ray.get(counter.counts.remote()), opened.runs, told)
        return _join(opened, tasks, shards, storage, Path(out))
    finally:
        for left in tasks:
            ray.cancel(left, force=True)
        ray.kill(counter)


def _wait(
    tasks: list[Any], counts: Callable[[], tuple[int, int]], total: int, progress: Report | None
) -> None:
    left = tasks
    while left:
        ended, left = ray.wait(left, num_returns=len(left), timeout=LOOK)
        for task in ended:
            ray.get(task)  # A task that failed ends the campaign at once.
        if progress is not None:
            done, violated = counts()
            progress(done if left else total, total, violated)


def _join(
    opened: _core.Campaign, tasks: list[Any], shards: int, storage: str | None, out: Path
) -> CampaignResult:
    with tempfile.TemporaryDirectory(prefix="gyrfalcon-") as folder:
        directories = []
        for number, task in enumerate(tasks, 1):
            name = f"{opened.name}.{number}-of-{shards}"
            directory = Path(folder) / name
            directories.append(directory)
            if storage is None:
                directory.mkdir()
                for file, content in ray.get(task).items():
                    (directory / file).write_bytes(content)
            elif not _fetch(storage, name if shards > 1 else opened.name, directory):
                raise CampaignError(f"{storage}: {name} is not there")
        return merge(directories, out=out)


def _file_system(storage: str) -> tuple[Any, str]:
    import fsspec

    system, path = fsspec.core.url_to_fs(storage)
    return system, path


def _fetch(storage: str, name: str, folder: Path) -> bool:
    """Copies the files of a finished shard to `folder`; whether they are there."""
    system, path = _file_system(storage)
    source = f"{path}/{name}"
    if not system.exists(f"{source}/complete.json"):
        return False
    folder.mkdir(parents=True, exist_ok=True)
    for file in FILES:
        (folder / file).write_bytes(system.cat_file(f"{source}/{file}"))
    return True


def _put(storage: str, name: str, files: Mapping[str, bytes]) -> None:
    """Copies the files of a finished shard to `storage`; the one that says so comes last."""
    system, path = _file_system(storage)
    target = f"{path}/{name}"
    system.makedirs(target, exist_ok=True)
    for file, content in files.items():
        system.pipe_file(f"{target}/{file}", content)
    sizes = {file: len(content) for file, content in files.items()}
    system.pipe_file(f"{target}/complete.json", json.dumps(sizes).encode())
