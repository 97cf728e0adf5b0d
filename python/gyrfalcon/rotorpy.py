"""Adapters for RotorPy: this project's controllers in its simulator, and its controllers in this one.

Neither needs RotorPy itself. Its frames are these: world z up, body x forward, y left; only its quaternions
have the scalar last.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import Controller, Scenario

PERIOD_TOLERANCE = 1e-3
"""Relative difference between two times of RotorPy and the step period that is taken for rounding."""


class RotorPyController(Protocol):
    """A controller of RotorPy."""

    def update(
        self, t: float, state: Mapping[str, Any], flat_output: Mapping[str, Any]
    ) -> Mapping[str, Any]: ...


def facing(
    derivatives: ArrayLike, yaw: float = 0.0, yaw_rate: float = 0.0, yaw_acceleration: float = 0.0
) -> NDArray[np.float32]:
    """The reference, shape (24,), along a motion with a heading.

    `derivatives`: shape (15,) or (5, 3): position, velocity, acceleration, jerk, snap (m/s^n, world). Body x keeps
    as close to `yaw` (rad, from world x) as the thrust direction allows, with exact derivatives of `b2d`.
    """
    flat = np.asarray(derivatives, np.float32).reshape(-1)
    return _core.facing(flat, yaw, yaw_rate, yaw_acceleration)


class GyrfalconController:
    """A controller of the paper for `rotorpy.environments.Environment`.

    `config`: a Scenario, or the mapping of its `[controller]` table. `quad_params`: RotorPy's parameters of the
    vehicle, for the rotors' allocation. The environment's `sim_rate` must be 1/`step_period`: the law is
    fixed-step, and `update` raises ValueError otherwise. A time that does not increase begins a new flight.
    """

    def __init__(self, config: Scenario | Mapping[str, Any], quad_params: Mapping[str, Any]) -> None:
        self.controller = Controller(config)
        ratio = quad_params["k_m"] / quad_params["k_eta"]
        arms = np.array(list(quad_params["rotor_pos"].values()))
        # Collective thrust, and torque of a force along body z at each arm, with the rotor's own torque.
        directions = ratio * np.asarray(quad_params["rotor_directions"])
        wrench = np.vstack([np.ones(len(arms)), arms[:, 1], -arms[:, 0], directions])
        self._allocation = np.linalg.pinv(wrench)
        self._thrust_coefficient = quad_params["k_eta"]
        self._time: float | None = None

    def update(
        self, t: float, state: Mapping[str, Any], flat_output: Mapping[str, Any]
    ) -> dict[str, Any]:
        """RotorPy's call at every step: its state and flat outputs to its control inputs."""
        self._check_time(t)
        x, y, z, w = state["q"]
        row = np.concatenate([state["x"], state["v"], [w, x, y, z], state["w"]])
        names = ("x", "x_dot", "x_ddot", "x_dddot", "x_ddddot")
        motion = np.concatenate([flat_output[name] for name in names])
        turning = (flat_output["yaw"], flat_output["yaw_dot"], flat_output.get("yaw_ddot", 0.0))
        output = self.controller.step(row, facing(motion, *turning))
        wrench = output.wrench.astype(float)
        forces = self._allocation @ wrench
        speeds = np.sign(forces) * np.sqrt(np.abs(forces) / self._thrust_coefficient)
        return {
            "cmd_motor_speeds": speeds,
            "cmd_motor_thrusts": forces,
            "cmd_thrust": wrench[0],
            "cmd_moment": wrench[1:],
            "cmd_q": np.array([0.0, 0.0, 0.0, 1.0]),
            "cmd_w": np.zeros(3),
            "cmd_v": np.asarray(flat_output["x_dot"], float),
            "cmd_acc": np.asarray(flat_output["x_ddot"], float),
        }

    def _check_time(self, time: float) -> None:
        period = self.controller.step_period
        if self._time is None or time <= self._time:
            self.controller.reset()
        elif abs(time - self._time - period) > PERIOD_TOLERANCE * period:
            raise ValueError(
                f"a step of {time - self._time:g} s must be the controller's {period:g} s: "
                f"set sim_rate = {1.0 / period:g}"
            )
        self._time = time


def law(
    controller: RotorPyController,
    torque_max: float | Sequence[float] | None = None,
    thrust_max: float | None = None,
) -> Callable[[float, NDArray[np.float32], NDArray[np.float32]], NDArray[np.float64]]:
    """A controller of RotorPy as the `controller` of `gyrfalcon.run`.

    Its `cmd_thrust` and `cmd_moment` are the wrench; thrust is cut to [0, `thrust_max`] (N), the torque to
    `torque_max` (N m), one for all body axes or three, where these are given.
    """
    limit_thrust = np.inf if thrust_max is None else thrust_max
    limit_torque = np.inf if torque_max is None else np.asarray(torque_max)

    def wrench(
        time: float, state: NDArray[np.float32], reference: NDArray[np.float32]
    ) -> NDArray[np.float64]:
        row, wanted = state.astype(float), reference.astype(float)
        w, x, y, z = row[6:10]
        own = {"x": row[0:3], "v": row[3:6], "q": np.array([x, y, z, w]), "w": row[10:13]}
        left, turning = wanted[15:17], wanted[18:20]
        flat = {
            "x": wanted[0:3],
            "x_dot": wanted[3:6],
            "x_ddot": wanted[6:9],
            "x_dddot": wanted[9:12],
            "x_ddddot": wanted[12:15],
            # b2d is orthogonal to the horizontal direction of body x.
            "yaw": np.arctan2(-left[0], left[1]),
            "yaw_dot": (left[0] * turning[1] - left[1] * turning[0]) / (left @ left),
        }
        command = controller.update(time, own, flat)
        thrust = np.clip(command["cmd_thrust"], 0.0, limit_thrust)
        return np.concatenate([[thrust], np.clip(command["cmd_moment"], -limit_torque, limit_torque)])

    return wrench
