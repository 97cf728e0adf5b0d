"""Flights: columns, verdicts, figures, interruption."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import gyrfalcon
import numpy as np
import pytest
from gyrfalcon import QUANTITIES, Flight, Scenario


@pytest.fixture(scope="module")
def flight() -> Flight:
    return gyrfalcon.run("paper-saturated", every=20)


def test_columns_have_the_shapes_of_their_quantities(flight: Flight) -> None:
    assert set(flight) == set(QUANTITIES)
    for name, quantity in QUANTITIES.items():
        width = len(quantity.suffixes)
        shape = (10_000,) if width == 1 else (10_000, width)
        assert flight[name].shape == shape, name
    assert flight.position is flight["position"]
    assert flight.position.dtype == np.float32 and flight.time.dtype == np.float64
    assert QUANTITIES["thrust"].unit == "N" and QUANTITIES["thrust"].topic == "wrench"
    with pytest.raises(KeyError, match="no quantity 'speed'"):
        flight["speed"]
    with pytest.raises(AttributeError, match="speed"):
        _ = flight.speed


def test_the_paper_s_flight_keeps_every_guarantee(flight: Flight) -> None:
    assert flight.passed and len(flight.verdicts) > 20
    row = flight.verdicts.named("thrust, highest, against M_f")
    assert row.upper == 12.0 and row.observed is not None and row.observed < 12.0
    assert row.margin == pytest.approx(12.0 - row.observed) and row.unit == "N"
    assert "<td>pass</td>" in flight.verdicts._repr_html_()
    with pytest.raises(KeyError, match="thrust, lowest"):
        flight.verdicts.named("nothing")


def test_a_violated_guarantee_is_a_result() -> None:
    scenario = Scenario.builtin("paper-saturated").set({"duration": 1.0})
    flight = gyrfalcon.run(scenario)
    assert not flight.passed and "VIOLATED" in repr(flight)
    assert "FAIL" in str(flight.verdicts)


def test_a_table_has_a_column_per_component(flight: Flight) -> None:
    table = flight.to_pandas()
    assert table.index.name == "time"
    assert table["attitude_w"].to_numpy().tobytes() == flight.attitude[:, 0].tobytes()
    assert len(table.columns) == sum(len(it.suffixes) for it in QUANTITIES.values()) - 1


def test_figures_show_what_was_flown(flight: Flight) -> None:
    overview = flight.plot()
    assert len(overview.axes) == 6
    drawn = overview.axes[3].lines[0].get_ydata()
    assert np.max(drawn) == pytest.approx(np.max(flight.thrust))
    chosen = flight.plot("position_error", "status")
    assert [len(axes.lines) for axes in chosen.axes] == [3, 1]
    with pytest.raises(KeyError):
        flight.plot("speed")


def test_a_misspelt_quantity_gets_the_nearest_one(flight: Flight) -> None:
    for look in (lambda: flight["positon_error"], lambda: flight.plot("positon_error")):
        with pytest.raises(KeyError, match="did you mean 'position_error'"):
            look()
    with pytest.raises(AttributeError, match="did you mean 'thrust'"):
        _ = flight.thrst


def test_a_long_flight_is_drawn_by_its_outline_and_its_start_in_full() -> None:
    import matplotlib.pyplot as plt
    from gyrfalcon.figure import ROWS_MAX, draw

    flight = gyrfalcon.run(Scenario.builtin("paper-saturated").set({"duration": 20.0}))
    _, (whole, start) = plt.subplots(1, 2)
    draw(whole, flight, "torque")
    draw(start, flight, "torque", until=2.0)
    lines = [np.asarray(line.get_ydata()) for line in whole.lines]
    assert all(len(line) == ROWS_MAX for line in lines)
    assert [line.max() for line in lines] == flight.torque.max(axis=0).tolist()
    assert [line.min() for line in lines] == flight.torque.min(axis=0).tolist()
    drawn = np.asarray(start.lines[0].get_ydata())
    assert drawn.tolist() == flight.torque[:2000, 0].tolist()
    plt.close("all")


def test_progress_ends_at_the_last_tick() -> None:
    scenario = Scenario.builtin("lemniscate").set({"duration": 12.0})
    seen: list[tuple[int, int]] = []
    gyrfalcon.run(scenario, every=1000, progress=lambda done, of: seen.append((done, of)))
    assert seen == [(5000, 12_000), (10_000, 12_000), (12_000, 12_000)]
    with pytest.raises(ZeroDivisionError):
        gyrfalcon.run(scenario, progress=lambda done, of: 1 / 0)
    with pytest.raises(ValueError, match="every = 0 must be at least 1"):
        gyrfalcon.run(scenario, every=0)


def test_an_interrupt_ends_a_flight_of_hours_at_once(tmp_path: Path) -> None:
    code = (
        "import gyrfalcon\n"
        "s = gyrfalcon.Scenario.builtin('lemniscate').set({'duration': 1e6})\n"
        "print('flying', flush=True)\n"
        "try: gyrfalcon.run(s, every=1000000)\n"
        "except KeyboardInterrupt: print('interrupted')\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "flying\n"
    time.sleep(0.3)
    begin = time.monotonic()
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=20)
    assert rest == "interrupted\n"
    assert time.monotonic() - begin < 5.0


def test_other_threads_run_during_a_flight() -> None:
    import threading

    done = threading.Event()
    scenario = Scenario.builtin("lemniscate").set({"duration": 400.0})

    def fly() -> None:
        gyrfalcon.run(scenario, every=1000)
        done.set()

    thread = threading.Thread(target=fly)
    thread.start()
    count = 0
    while not done.is_set():
        count += 1
        time.sleep(0.001)
    thread.join()
    assert count > 20
