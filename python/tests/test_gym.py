"""The environments of gymnasium."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gyrfalcon.gym import TrackingEnv, TrackingVectorEnv

TASK: dict[str, Any] = {"position_limit": 1.2}


def test_the_environment_passes_the_checks_of_gymnasium() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(TrackingEnv(), skip_render_check=True)
    made = gymnasium.make("gyrfalcon/Tracking-v0", scenario="lemniscate", torque_max=0.2)
    check_env(made.unwrapped, skip_render_check=True)


def test_the_vector_environment_is_its_single_ones_in_step_and_autoreset() -> None:
    count = 6
    ours = TrackingVectorEnv(count, **TASK)
    theirs = SyncVectorEnv(
        [lambda: TrackingEnv(**TASK) for _ in range(count)], autoreset_mode=AutoresetMode.NEXT_STEP
    )
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    first, second = ours.reset(seed=7)[0], theirs.reset(seed=7)[0]
    assert first.tobytes() == second.tobytes() and first in ours.observation_space
    random, ends = np.random.default_rng(3), 0
    for _ in range(300):
        actions = random.uniform(-1.0, 1.0, (count, 4)).astype(np.float32)
        one, two = ours.step(actions), theirs.step(actions)
        assert one[0].tobytes() == two[0].tobytes() and one[0] in ours.observation_space
        assert np.allclose(one[1], two[1], atol=1e-7)
        assert (one[2] == two[2]).all() and (one[3] == two[3]).all()
        ends += int(one[2].sum())
    assert ends > 10, "lanes must end and begin anew"
    made = gymnasium.make_vec("gyrfalcon/Tracking-v0", num_envs=3)
    assert isinstance(made.unwrapped, TrackingVectorEnv)


def test_hovering_thrust_holds_a_vehicle_and_an_episode_ends_in_time() -> None:
    task: dict[str, Any] = {"position_spread": 0.0, "tilt_spread": 0.0, "ticks": 50, "torque_max": 0.2}
    env = TrackingEnv(scenario="hover-gusts", **task)
    start, _ = env.reset(seed=1)
    scenario = env.lanes.scenario
    action = np.zeros(4, np.float32)
    action[0] = 2.0 * scenario.mass * 9.81 / env.lanes.scale[0] - 1.0
    state, reward, lost, late, _ = env.step(action)
    assert abs(state[2] - start[2]) < 0.02 and reward > 0.1 and not lost and not late
    short = TrackingEnv(scenario=scenario.set({"duration": 0.1}), **task)
    short.reset(seed=1)
    assert [short.step(action)[3] for _ in range(2)] == [False, True]


def test_a_task_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="torque_max must be given"):
        TrackingEnv(scenario="paper-robust-adaptive")
    assert TrackingEnv(scenario="paper-robust-adaptive", torque_max=1.0).action_space.shape == (4,)
    with pytest.raises(ValueError, match="ticks = 0"):
        TrackingEnv(ticks=0)
