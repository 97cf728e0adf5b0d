"""RotorPy: our controller flies its vehicle, its controller flies ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gyrfalcon
import numpy as np
import pytest
from gyrfalcon import Scenario
from gyrfalcon.rotorpy import GyrfalconController, facing, law

VEHICLE = """
name = "hummingbird"
mass = { lower = 0.4, upper = 0.6 }
inertia = { lower = 3e-3, upper = 8e-3 }
disturbance_acceleration = 1.0
disturbance_torque = 0.01
reference_acceleration_max = 1.0
thrust_max = 16.0
torque_max = 0.5
step_period = 0.002

[wanted]
position_bandwidth = 1.5
"""


@pytest.fixture(scope="module")
def gains(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    path = tmp_path_factory.mktemp("vehicle") / "hummingbird.toml"
    path.write_text(VEHICLE)
    return gyrfalcon.tune(path, check=False).scenario


def vehicle() -> tuple[Any, dict[str, Any]]:
    from rotorpy.vehicles.hummingbird_params import quad_params
    from rotorpy.vehicles.multirotor import Multirotor

    params = {**quad_params, "mass": 1.2 * quad_params["mass"]}
    start = {
        "x": np.array([1.0, 0.3, 0.2]),
        "v": np.zeros(3),
        "q": np.array([0.0, 0.0, 0.0, 1.0]),
        "w": np.zeros(3),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(4, 500.0),
    }
    return Multirotor(params, initial_state=start, aero=False), params


def test_our_controller_flies_rotorpy_s_vehicle(gains: Scenario) -> None:
    from rotorpy.environments import Environment
    from rotorpy.trajectories.circular_traj import ThreeDCircularTraj

    multirotor, params = vehicle()
    controller = GyrfalconController(gains, params)
    trajectory = ThreeDCircularTraj(
        radius=np.array([1.0, 1.0, 0.2]), freq=np.array([0.1, 0.1, 0.05]), yaw_traj="forward"
    )
    flight = Environment(multirotor, controller, trajectory, sim_rate=500).run(t_final=12.0)
    error = np.linalg.norm(flight["state"]["x"] - flight["flat"]["x"], axis=1)
    assert len(error) > 5_900
    assert error[0] > 0.3 and error[-500:].max() < 0.02
    mass = 1.0 / controller.controller.estimates["inverse_mass"]
    assert mass == pytest.approx(params["mass"], rel=0.01)


def test_another_rate_than_the_controller_s_is_refused(gains: Scenario) -> None:
    from rotorpy.trajectories.hover_traj import HoverTraj

    multirotor, params = vehicle()
    controller = GyrfalconController(gains, params)
    wanted, state = HoverTraj().update(0.0), multirotor.initial_state
    first = controller.update(0.0, state, wanted)
    controller.update(0.002, state, wanted)
    with pytest.raises(ValueError, match="set sim_rate = 500"):
        controller.update(0.012, state, wanted)
    again = controller.update(0.0, state, wanted)
    assert again["cmd_thrust"] == first["cmd_thrust"]
    assert first["cmd_motor_thrusts"].sum() == pytest.approx(first["cmd_thrust"])
    assert np.allclose(multirotor.f_to_TM @ first["cmd_motor_thrusts"], [first["cmd_thrust"], *first["cmd_moment"]])


def test_rotorpy_s_controller_flies_our_vehicle() -> None:
    from rotorpy.controllers.quadrotor_control import SE3Control
    from rotorpy.vehicles.hummingbird_params import quad_params

    scenario = Scenario.builtin("lemniscate").set({"duration": 6.0})
    inertia = dict(zip(("Ixx", "Iyy", "Izz"), scenario.inertia, strict=True))
    se3 = SE3Control({**quad_params, **inertia, "mass": scenario.mass})
    flight = gyrfalcon.run(scenario, controller=law(se3))
    assert abs(flight.position_error[-1]).max() < 0.1
    cut = gyrfalcon.run(scenario, controller=law(se3, torque_max=0.02, thrust_max=9.0), every=5)
    assert np.abs(cut.torque).max() <= np.float32(0.02) and cut.thrust.max() <= 9.0


def test_a_heading_has_the_derivatives_of_the_core_s_trajectories() -> None:
    scenario = Scenario.builtin("paper-saturated")
    for tick in (0, 1000, 50_000):
        wanted = scenario.reference([tick])[0]
        yaw = np.arctan2(-wanted[15], wanted[16])
        made = facing(wanted[:15], yaw, 0.05, 0.0)
        # The paper's b2d is horizontal: that of `facing` differs by what the thrust leans to the side.
        assert np.allclose(made[:15], wanted[:15])
        assert np.allclose(made[15:], wanted[15:], atol=0.05)
    later = [facing(np.zeros(15), 0.3 + 0.7 * t + 0.2 * t * t, 0.7 + 0.4 * t, 0.4) for t in (0.0, 1e-2)]
    slope = (later[1][15:21] - later[0][15:21]) / 1e-2
    assert np.allclose(slope, 0.5 * (later[0][18:24] + later[1][18:24]), atol=2e-3)
