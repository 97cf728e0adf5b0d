"""Viewers, headless: the recordings that they write are read back."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import gyrfalcon
import numpy as np
import pytest
from gyrfalcon import Scenario, Tick, live

SHORT = Scenario.builtin("tilt-recovery").set({"duration": 0.5})
EVERY = 20


@pytest.fixture(scope="module")
def flight() -> gyrfalcon.Flight:
    """The columns that the viewers must have shown: the first tick and every twentieth after it."""
    return gyrfalcon.run(SHORT)


def shown(flight: gyrfalcon.Flight, name: str) -> np.ndarray:
    rows = [0, *range(EVERY, len(flight["tick"]), EVERY), len(flight["tick"]) - 1]
    return np.asarray(flight[name])[sorted(set(rows))]


def test_watch_sees_the_first_tick_and_every_nth_after_it(flight: gyrfalcon.Flight) -> None:
    times: list[float] = []

    def watch(tick: Tick) -> None:
        times.append(tick.time)

    watched = gyrfalcon.run(SHORT, watch=watch, watch_every=EVERY)
    assert times == list(shown(flight, "time"))
    assert all(np.array_equal(watched[name], flight[name], equal_nan=True) for name in flight)
    with pytest.raises(ZeroDivisionError):
        gyrfalcon.run(SHORT, watch=lambda tick: 1 / 0)
    with pytest.raises(ValueError, match="watch_every = 0"):
        gyrfalcon.run(SHORT, watch=watch, watch_every=0)


def test_rerun_has_every_tick_with_its_place_and_numbers(
    tmp_path: Path, flight: gyrfalcon.Flight
) -> None:
    from rerun.chunk import RrdReader

    path = tmp_path / "flight.rrd"
    with live.Rerun(save=path, plots=["thrust", "torque"]) as viewer:
        gyrfalcon.run(SHORT, watch=viewer, watch_every=EVERY)
    batches: dict[str, list[Any]] = {}
    for chunk in RrdReader(path).stream():
        batches.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())

    def column(entity: str, name: str) -> np.ndarray:
        values = [row for batch in batches[entity] for row in batch.column(name).to_pylist()]
        return np.array(values, dtype=np.float64).squeeze()

    thrust = column("/plots/thrust", "Scalars:scalars")
    assert np.array_equal(thrust, shown(flight, "thrust").astype(np.float64))
    torque = column("/plots/torque_x", "Scalars:scalars")
    assert np.array_equal(torque, shown(flight, "torque")[:, 0].astype(np.float64))
    translation = column("/world/vehicle", "Transform3D:translation")
    assert np.allclose(translation, shown(flight, "position"), atol=1e-5)
    attitude = column("/world/vehicle", "Transform3D:quaternion")
    assert np.allclose(np.roll(attitude, 1, axis=1), shown(flight, "attitude"), atol=1e-6)
    times = [row for batch in batches["/world/vehicle"] for row in batch.column("time").to_pylist()]
    assert [time.total_seconds() for time in times] == pytest.approx(list(shown(flight, "time")))
    assert len(batches["/world/trail"]) > 0 and "/world/reference" in batches


def test_foxglove_has_every_tick_with_its_frames_and_numbers(
    tmp_path: Path, flight: gyrfalcon.Flight
) -> None:
    from mcap.reader import make_reader

    path = tmp_path / "flight.mcap"
    with live.Foxglove(save=path, plots=["thrust", "torque"]) as viewer:
        gyrfalcon.run(SHORT, watch=viewer, watch_every=EVERY)
    with path.open("rb") as file:
        messages = list(make_reader(file).iter_messages())
    topics = {channel.topic: schema.name for schema, channel, _ in messages if schema is not None}
    assert topics["/tf"] == "foxglove.FrameTransforms" and topics["/scene"] == "foxglove.SceneUpdate"
    numbers = [json.loads(it.data) for _, channel, it in messages if channel.topic == "/plots"]
    assert [it["thrust"] for it in numbers] == pytest.approx(list(shown(flight, "thrust")))
    assert [it["torque_x"] for it in numbers] == pytest.approx(list(shown(flight, "torque")[:, 0]))
    stamps = [it.log_time for _, channel, it in messages if channel.topic == "/tf"]
    assert stamps == [round(time * 1e9) for time in shown(flight, "time")]


def test_foxglove_serves_a_flight() -> None:
    with live.Foxglove(port=0) as viewer:
        assert viewer.port is not None and viewer.port > 0
        gyrfalcon.run(SHORT, watch=viewer, watch_every=100)


def test_a_pace_is_kept() -> None:
    begin = time.monotonic()
    seen: list[float] = []

    class Paced(live.Foxglove):
        def _show(self, tick: Tick) -> None:
            seen.append(tick.time)

    with Paced(port=0, speed=5.0) as viewer:
        gyrfalcon.run(SHORT, watch=viewer, watch_every=100)
    assert time.monotonic() - begin >= 0.09 and len(seen) == 6


def test_what_cannot_be_shown_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no quantity 'thurst'"):
        live.Rerun(save=tmp_path / "a.rrd", plots=["thurst"])
    with pytest.raises(ValueError, match="one of save, spawn and connect"):
        live.Rerun()
    with pytest.raises(ValueError, match="one of save and port"):
        live.Foxglove()
    with pytest.raises(ValueError, match="speed = 0"):
        live.Foxglove(port=0, speed=0)
