"""Batches: the bits of single controllers and flights, over arrays that the caller owns."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time

import gyrfalcon
import numpy as np
import pytest
from gyrfalcon import BatchController, BatchFlight, BatchVehicle, Controller, Scenario

COUNT = 300
SCENARIOS = ["paper-robust-adaptive", "paper-saturated"]


def states(count: int, seed: int = 1) -> np.ndarray:
    random = np.random.default_rng(seed)
    rows = random.normal(scale=0.3, size=(count, 13)).astype(np.float32)
    rows[:, 6:10] /= np.linalg.norm(rows[:, 6:10], axis=1, keepdims=True)
    return rows


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize("threads", [None, 1, 3])
def test_a_batch_of_controllers_has_the_bits_of_single_ones(name: str, threads: int | None) -> None:
    scenario = Scenario.builtin(name)
    batch = BatchController(scenario, COUNT, threads=threads)
    singles = [Controller(scenario) for _ in range(COUNT)]
    out = np.empty((COUNT, 4), dtype=np.float32)
    for tick in range(20):
        rows = states(COUNT, tick)
        rows[5, 0] = np.nan
        references = np.repeat(scenario.reference([tick]), COUNT, axis=0)
        assert batch.step(rows, references, out=out) is out
        for lane, single in enumerate(singles):
            output = single.step(rows[lane], references[lane])
            assert output.wrench.tobytes() == out[lane].tobytes(), (tick, lane)
            assert output.status == batch.status[lane]
    assert batch.status[5] & gyrfalcon.Status.OUTPUT_HELD


def test_a_reset_of_some_lanes_leaves_the_others() -> None:
    scenario = Scenario.builtin("paper-saturated")
    batch = BatchController(scenario, 4)
    rows, references = states(4), np.repeat(scenario.reference([0]), 4, axis=0)
    first = batch.step(rows, references)
    second = batch.step(rows, references)
    assert (first != second).any(axis=1).all()
    batch.reset([1, 3])
    third = batch.step(rows, references)
    assert third[1].tobytes() == first[1].tobytes() and third[3].tobytes() == first[3].tobytes()
    assert third[0].tobytes() != first[0].tobytes()
    batch.reset()
    assert batch.step(rows, references[:, :18].copy())[0].tobytes() != b""
    with pytest.raises(ValueError, match="lane 4 must be below 4"):
        batch.reset([4])


def test_arrays_are_never_copied_and_so_must_fit() -> None:
    scenario = Scenario.builtin("paper-saturated")
    batch = BatchController(scenario, 4)
    rows, references = states(4), np.repeat(scenario.reference([0]), 4, axis=0)
    with pytest.raises(TypeError, match="states must be a float32 array in C order of shape"):
        batch.step(rows.astype(np.float64), references)
    with pytest.raises(ValueError, match=r"states .* \(4, 13\); it has the shape \[3, 13\]"):
        batch.step(rows[:3], references)
    with pytest.raises(ValueError, match=r"references .* \(4, 24\) or \(4, 18\)"):
        batch.step(rows, references[:, :20].copy())
    with pytest.raises(ValueError, match="in C order"):
        batch.step(np.asfortranarray(rows), references)
    out = np.zeros((4, 4), dtype=np.float32)
    out.flags.writeable = False
    with pytest.raises(ValueError, match="out: "):
        batch.step(rows, references, out=out)
    wide = np.zeros((4, 13), dtype=np.float32)
    with pytest.raises(ValueError, match="out"):
        batch.step(rows, references, out=wide)
    with pytest.raises(ValueError, match="threads: 0"):
        BatchController(scenario, 4, threads=0)


@pytest.mark.parametrize("threads", [None, 1])
def test_a_batch_of_flights_has_the_bits_of_single_ones(threads: int | None) -> None:
    scenarios = [Scenario.builtin(name).set({"duration": 2.0}) for name in (*SCENARIOS, "waypoints")]
    batch = BatchFlight(scenarios, threads=threads)
    out = np.empty((3, 13), dtype=np.float32)
    single = [gyrfalcon.run(scenario) for scenario in scenarios]
    assert batch.advance(700, out=out) is out
    for lane, flight in enumerate(single):
        row = np.hstack([flight[name][700] for name in ("position", "velocity", "attitude", "rate")])
        assert row.tobytes() == out[lane].tobytes()
        reference = batch.references()[lane]
        assert reference.tobytes() == scenarios[lane].reference([700])[0].tobytes()
    assert batch.ticks.tolist() == [700] * 3
    batch.replace(1, scenarios[0])
    assert batch.ticks.tolist() == [700, 0, 700]
    batch.advance(700)
    assert batch.states()[1].tobytes() == out[0].tobytes()


def test_a_lane_per_seed_flies_that_seed() -> None:
    scenario = Scenario.builtin("hover-gusts").set({"duration": 1.0})
    batch = BatchFlight(scenario, seeds=[3, 4])
    batch.advance(999)
    for lane, seed in enumerate((3, 4)):
        flight = gyrfalcon.run(scenario.set({"seed": seed}))
        assert batch.states()[lane, :3].tobytes() == flight.position[999].tobytes()
    assert (batch.states()[0] != batch.states()[1]).any()
    with pytest.raises(TypeError, match="seeds go with one scenario"):
        BatchFlight([scenario], seeds=[1])


def test_vehicles_under_the_commands_of_a_flight_repeat_it() -> None:
    scenario = Scenario.builtin("paper-saturated").set({"duration": 0.5})
    flight = gyrfalcon.run(scenario)
    vehicles = BatchVehicle([scenario, scenario])
    commands = np.hstack([flight.thrust[:, None], flight.torque])
    for command in commands[:-1]:
        rows = vehicles.step(np.stack([command, command]))
    last = np.hstack([flight[name][-1] for name in ("position", "velocity", "attitude", "rate")])
    assert rows[0].tobytes() == last.tobytes() == rows[1].tobytes()
    hostile = np.stack([commands[0], commands[0]])
    hostile[1, 2] = np.inf
    with pytest.raises(ValueError, match="lane 1 has inf"):
        vehicles.step(hostile)
    assert vehicles.ticks.tolist() == [499, 499]


def test_other_threads_run_during_a_batch() -> None:
    batch = BatchFlight(Scenario.builtin("lemniscate"), seeds=range(50))
    done = threading.Event()

    def fly() -> None:
        batch.advance(20_000)
        done.set()

    thread = threading.Thread(target=fly)
    thread.start()
    count = 0
    while not done.is_set():
        count += 1
        time.sleep(0.001)
    thread.join()
    assert count > 20


def test_an_interrupt_ends_a_batch() -> None:
    code = (
        "import gyrfalcon\n"
        "b = gyrfalcon.BatchFlight(gyrfalcon.Scenario.builtin('lemniscate'), seeds=range(8))\n"
        "print('flying', flush=True)\n"
        "try: b.advance(10**9)\n"
        "except KeyboardInterrupt: print('interrupted', (b.ticks < 10**9).all())\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "flying\n"
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=20)
    assert rest == "interrupted True\n"
