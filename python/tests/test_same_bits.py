"""A flight from Python has the bits of the program's trace."""

from __future__ import annotations

import csv
import subprocess
from pathlib import Path

import gyrfalcon
import numpy as np
import pytest


def traced(program: Path, folder: Path, scenario: str, changes: list[str]) -> dict[str, list[str]]:
    """Columns of the program's trace as text."""
    options = [word for change in changes for word in ("--set", change)]
    command = [str(program), "run", scenario, "--quiet", "--trace-every", "1", "--out", str(folder)]
    status = subprocess.run(command + options, check=False, stdout=subprocess.DEVNULL).returncode
    assert status in (0, 1), "1: a flight that ends before it has settled violates a guarantee"
    with (folder / scenario / "trace.csv").open() as file:
        rows = list(csv.reader(file))
    return {name: [row[i] for row in rows[1:]] for i, name in enumerate(rows[0])}


@pytest.mark.parametrize("scenario", ["paper-robust-adaptive", "paper-saturated", "tilt-recovery"])
def test_twenty_seconds_have_the_bits_of_the_trace(
    program: Path, tmp_path: Path, scenario: str
) -> None:
    trace = traced(program, tmp_path, scenario, ["duration=20.0"])
    flight = gyrfalcon.run(gyrfalcon.Scenario.builtin(scenario).set({"duration": 20.0}))
    table = flight.to_pandas().reset_index()
    assert len(table) == 20_000
    assert len(trace) >= 60
    for name, texts in trace.items():
        values = table[name].to_numpy()
        assert len(values) == len(texts)
        if name == "time":
            assert [f"{value:.6f}" for value in values] == texts
        else:
            expected = np.array(texts, dtype=np.float64).astype(values.dtype)
            assert values.tobytes() == expected.tobytes(), name


def test_a_controller_stepped_by_hand_gives_the_commands_of_the_flight() -> None:
    scenario = gyrfalcon.Scenario.builtin("paper-saturated").set({"duration": 2.0})
    flight = gyrfalcon.run(scenario)
    controller = gyrfalcon.Controller(scenario)
    references = scenario.reference(range(scenario.ticks))
    states = np.hstack([flight.position, flight.velocity, flight.attitude, flight.rate])
    for tick, (state, reference) in enumerate(zip(states, references, strict=True)):
        output = controller.step(state, reference)
        assert output.thrust == flight.thrust[tick]
        assert output.torque.tobytes() == flight.torque[tick].tobytes()
        assert output.status == flight.status[tick]
    estimate = 1.0 / controller.estimates["inverse_mass"]
    assert abs(estimate - flight.mass_estimate[-1]) < 1e-3


def test_every_tenth_row_is_that_of_the_whole() -> None:
    scenario = gyrfalcon.Scenario.builtin("lemniscate").set({"duration": 0.5})
    whole, thinned = gyrfalcon.run(scenario), gyrfalcon.run(scenario, every=10)
    for name in whole:
        assert whole[name][::10].tobytes() == thinned[name].tobytes(), name
    assert whole.verdicts == thinned.verdicts
