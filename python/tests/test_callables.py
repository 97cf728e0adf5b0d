"""Controller, plant, disturbance and monitor of one's own in the loop."""

from __future__ import annotations

from typing import Any

import gyrfalcon
import numpy as np
import pytest
from gyrfalcon import Controller, Monitor, Scenario

Array = np.ndarray[Any, np.dtype[Any]]
SHORT = Scenario.builtin("paper-saturated").set({"duration": 1.0})
QUANTITIES = ("position", "velocity", "attitude", "rate", "thrust", "torque")
LEVEL = np.array([0.85 * 9.81, 0.0, 0.0, 0.0])


def same(first: gyrfalcon.Flight, second: gyrfalcon.Flight) -> None:
    for name in QUANTITIES:
        assert first[name].tobytes() == second[name].tobytes(), name


def test_the_built_in_law_called_from_python_flies_the_same_bits() -> None:
    law = Controller(SHORT)
    flight = gyrfalcon.run(SHORT, controller=lambda _, state, wanted: law.step(state, wanted))
    same(flight, gyrfalcon.run(SHORT))
    names = {verdict.name for verdict in flight.verdicts}
    assert any(name.startswith("position error") for name in names)
    assert not any("Lyapunov" in name for name in names)


def test_a_disturbance_acts_and_is_logged() -> None:
    seen: list[float] = []

    def push(time: float, state: Array) -> list[float]:
        assert state.shape == (13,) and state.dtype == np.float64
        seen.append(time)
        return [0.04, 0.0, 0.0, 0.0, 0.0, 0.01 * time]

    flight = gyrfalcon.run(SHORT, disturbance=push)
    assert seen == flight.time.tolist()
    assert (flight.disturbance_acceleration[:, 0] == np.float32(0.04)).all()
    assert flight.disturbance_torque[-1, 2] == np.float32(0.01 * seen[-1])
    calm = gyrfalcon.run(SHORT, disturbance=lambda time, state: np.zeros(6))
    assert flight.velocity[-1, 0] - calm.velocity[-1, 0] > 0.02


def test_a_plant_of_one_s_own_moves_as_it_says() -> None:
    period = SHORT.step_period

    def falling(state: Array, wrench: Array, disturbance: Array) -> Array:
        assert wrench.shape == (4,) and disturbance.shape == (6,) and wrench[0] > 0.0
        state[0:3] += period * state[3:6]
        state[5] -= period * 9.81
        return state

    flight = gyrfalcon.run(SHORT, plant=falling)
    assert flight.velocity[-1, 2] == pytest.approx(-9.81 * 0.999, rel=1e-5)
    assert not flight.passed


def test_every_part_of_one_s_own_at_once() -> None:
    flight = gyrfalcon.run(
        SHORT,
        controller=lambda time, state, reference: LEVEL,
        plant=lambda state, wrench, disturbance: state,
        disturbance=lambda time, state: np.zeros(6),
        every=100,
    )
    assert (flight.position == flight.position[0]).all() and flight.thrust[0] == np.float32(LEVEL[0])


def test_a_monitor_judges_every_tick() -> None:
    speed = Monitor("speed", lambda tick: float(np.linalg.norm(tick["velocity"])), at_most=0.5, unit="m/s")
    late = Monitor("height, late", lambda tick: tick["position"][2], at_least=-100.0, since=0.9)
    both = Monitor("thrust", lambda tick: tick["thrust"], at_least=0.0, at_most=12.0)
    told = Monitor("time", lambda tick: tick.time)
    flight = gyrfalcon.run(SHORT, every=1000, monitors=[speed, late, both, told])
    whole = gyrfalcon.run(SHORT)
    fastest = np.linalg.norm(whole.velocity.astype(float), axis=1).max()
    row = flight.verdicts.named("speed")
    assert row.observed == pytest.approx(fastest) and row.unit == "m/s"
    assert row.passed == (fastest <= 0.5)
    row = flight.verdicts.named("height, late")
    assert row.time is not None and row.time >= 0.9 and row.passed
    assert flight.verdicts.named("thrust").bound == "[0, 12]"
    assert flight.verdicts.named("time").observed == pytest.approx(0.999)
    with pytest.raises(KeyError, match="no quantity"):
        gyrfalcon.run(SHORT, monitors=[Monitor("x", lambda tick: tick["speed"])])


@pytest.mark.parametrize("role", ["controller", "plant", "disturbance"])
def test_what_a_callable_returns_is_checked(role: str) -> None:
    results: list[tuple[object, type[Exception], str]] = [
        ([1.0, 2.0], ValueError, f"result of {role} has 2 numbers"),
        (np.full(13 if role == "plant" else 6 if role == "disturbance" else 4, np.nan), ValueError, "finite"),
        ("nothing", Exception, "."),
        (None, Exception, "."),
    ]
    for result, error, message in results:
        calls: list[int] = []

        def returns(*_: object, result: object = result, calls: list[int] = calls) -> Any:
            calls.append(1)
            return result

        with pytest.raises(error, match=message):
            gyrfalcon.run(SHORT, **{role: returns})  # type: ignore[arg-type]
        assert len(calls) == 1, "the flight ends at the tick"


@pytest.mark.parametrize("role", ["controller", "plant", "disturbance"])
def test_an_exception_of_a_callable_ends_the_flight(role: str) -> None:
    def interrupted(*_: object) -> Any:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        gyrfalcon.run(SHORT, **{role: interrupted})  # type: ignore[arg-type]
