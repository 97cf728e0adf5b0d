"""Environments of gymnasium: track a scenario's trajectory by commanding thrust and torque.

Needs gymnasium. `gymnasium.make("gyrfalcon/Tracking-v0")` and `make_vec` find both after an import of this
module.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from ._core import BatchVehicle, Controller, Scenario
from .flight import opened

Array = NDArray[np.float32]

SPEED_MAX, RATE_MAX, ACCELERATION_MAX = 100.0, 100.0, 10.0
"""Bounds of what is observed of velocity error (m/s), rate (rad/s) and reference acceleration (m/s^2)."""


@dataclass(frozen=True)
class Task:
    """What is to be learned.

    Attributes:
        scenario: vehicle, disturbance and trajectory; its duration ends an episode.
        ticks: control ticks per action.
        thrust_max: thrust at the action 1 (N); the scenario's limit unless given.
        torque_max: torque at the action 1 (N m), one for all body axes or three; the scenario's limits unless given.
        position_limit: distance from the reference at which an episode ends (m).
        position_spread: largest offset of each component of the first position (m).
        tilt_spread: largest angle of the first tilt (deg).
    """

    scenario: Scenario | str = "waypoints"
    ticks: int = 10
    thrust_max: float | None = None
    torque_max: float | Sequence[float] | None = None
    position_limit: float = 10.0
    position_spread: float = 1.0
    tilt_spread: float = 10.0


class Lanes:
    """Vehicles of a task, with a generator of random numbers each: the common part of both environments.

    Action, shape (4,), in [-1, 1]: thrust from zero to `thrust_max`, torque to `torque_max` each way.
    Observation, shape (19,): position error (m), velocity error (m/s), attitude w x y z, rate (rad/s, body),
    reference acceleration (m/s^2), `b2d`. Reward: 1/(1 + |position error|^2), less 1 % of the squared torque action.
    """

    def __init__(self, task: Task, count: int) -> None:
        if task.ticks < 1:
            raise ValueError(f"ticks = {task.ticks} must be at least 1")
        self.task = task
        self.scenario = opened(task.scenario)
        _, thrust, torque = Controller(self.scenario).bounds
        given = torque if task.torque_max is None else np.asarray(task.torque_max, np.float32)
        torques = np.broadcast_to(given, 3)
        self.scale = np.array([task.thrust_max or thrust, *torques], np.float32)
        if self.scale[1:].max() > 1e30:
            raise ValueError("torque_max must be given: the scenario's controller has no limit of its own")
        self.initial = self.scenario.initial_state
        self.vehicles = BatchVehicle([self.scenario] * count)
        self.randoms: list[np.random.Generator] = [seeding.np_random(None)[0] for _ in range(count)]
        self._states = np.empty((count, 13), np.float32)
        self._references = np.empty((count, 24), np.float32)
        limits = [task.position_limit] * 3 + [SPEED_MAX] * 3 + [1.0] * 4 + [RATE_MAX] * 3
        self.limits = np.array([*limits, *3 * [ACCELERATION_MAX], *3 * [1.0]], np.float32)

    @property
    def observation_space(self) -> Any:
        """Observations of one vehicle."""
        return spaces.Box(-self.limits, self.limits, dtype=np.float32)

    @property
    def action_space(self) -> Any:
        """Actions of one vehicle."""
        return spaces.Box(-1.0, 1.0, (4,), np.float32)

    def begin(self, lane: int) -> None:
        """Puts a vehicle to a random start, under disturbances of a random seed."""
        random, task = self.randoms[lane], self.task
        offset = random.uniform(-task.position_spread, task.position_spread, 3)
        start = {
            "seed": int(random.integers(1, 2**31)),
            "initial.position": self.initial[:3] + offset,
            "initial.tilt_deg": random.uniform(0.0, task.tilt_spread),
            "initial.tilt_direction_deg": random.uniform(0.0, 360.0),
        }
        self.vehicles.replace(lane, self.scenario.set(start))

    def observe(self) -> Array:
        """The observations now, shape (N, 19)."""
        states = self.vehicles.states(out=self._states)
        references = self.vehicles.references(out=self._references)
        errors = states[:, :6] - references[:, :6]
        rows = np.hstack([errors, states[:, 6:], references[:, 6:9], references[:, 15:18]])
        rows = np.nan_to_num(rows, posinf=np.inf, neginf=-np.inf)
        clipped: Array = np.clip(rows, -self.limits, self.limits).astype(np.float32)
        return clipped

    def step(self, actions: Array) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
        """Flies on under the actions, shape (N, 4); rewards, ends by distance, ends by time."""
        actions = np.clip(np.asarray(actions, np.float32), -1.0, 1.0)
        wrenches = actions * self.scale
        wrenches[:, 0] = 0.5 * (actions[:, 0] + 1.0) * self.scale[0]
        states = self.vehicles.step(wrenches, self.task.ticks, out=self._states)
        references = self.vehicles.references(out=self._references)
        distance = np.linalg.norm(states[:, :3] - references[:, :3], axis=1)
        lost = ~(distance < self.task.position_limit)
        late = self.vehicles.ticks >= self.scenario.ticks
        effort = 0.01 * np.square(actions[:, 1:]).sum(axis=1)
        rewards = np.where(lost, 0.0, 1.0 / (1.0 + distance**2)) - effort
        return rewards.astype(np.float32), lost, late & ~lost


class TrackingEnv(gymnasium.Env[Array, Array]):
    """One vehicle; `Lanes` describes action, observation and reward. Arguments are those of `Task`."""

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(self, **task: Any) -> None:
        self.lanes = Lanes(Task(**task), 1)
        self.observation_space = self.lanes.observation_space
        self.action_space = self.lanes.action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        super().reset(seed=seed)
        self.lanes.randoms[0] = self.np_random
        self.lanes.begin(0)
        return self.lanes.observe()[0], {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        rewards, lost, late = self.lanes.step(np.asarray(action, np.float32)[None])
        return self.lanes.observe()[0], float(rewards[0]), bool(lost[0]), bool(late[0]), {}


class TrackingVectorEnv(VectorEnv[Array, Array, Any]):
    """Many vehicles at once, on all cores; each lane as a `TrackingEnv` with the seed `seed + lane`.

    A lane that has ended begins anew in the next step, whose action for it is ignored.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(self, num_envs: int = 1, **task: Any) -> None:
        self.lanes = Lanes(Task(**task), num_envs)
        self.num_envs = num_envs
        self.single_observation_space = self.lanes.observation_space
        self.single_action_space = self.lanes.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._ended = np.zeros(num_envs, np.bool_)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        if isinstance(seed, list):
            seeds = seed
        else:
            seeds = [None if seed is None else seed + lane for lane in range(self.num_envs)]
        for lane, own in enumerate(seeds):
            if own is not None:
                self.lanes.randoms[lane] = seeding.np_random(own)[0]
            self.lanes.begin(lane)
        self._ended[:] = False
        return self.lanes.observe(), {}

    def step(
        self, actions: Array
    ) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        rewards, lost, late = self.lanes.step(actions)
        for lane in np.flatnonzero(self._ended):
            self.lanes.begin(int(lane))
        for result in (rewards, lost, late):
            result[self._ended] = 0
        self._ended = lost | late
        return self.lanes.observe(), rewards, lost, late, {}


gymnasium.register(
    "gyrfalcon/Tracking-v0", entry_point=TrackingEnv, vector_entry_point=TrackingVectorEnv
)
