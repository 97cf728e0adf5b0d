"""Reads a ULog with `pyulog` and holds it against the trace of the same flight.

    python3 read_ulog.py flight.ulg trace.csv EVERY

EVERY: rows of the trace from one instant of the log to the next. Prints what is left to check as JSON.
"""

import json
import sys

import numpy as np
from pyulog import ULog
from pyulog.px4 import PX4ULog

from flight_trace import Trace, matrices, rising, same

# PX4's axes in ours: north, east, down; forward, right, down.
NED = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]])
FRD = np.diag([1, -1, -1.0])
ROUNDING = 1e-6  # of rotation matrices and ratios in single precision
RATE_ROUNDING = 4e-6  # of a difference of two rates of up to 16 rad/s in single precision [rad/s]


def field(log, topic, name):
    """A field as an array, a row an instant."""
    data = log.get_dataset(topic).data
    if name in data:
        return data[name][:, np.newaxis]
    parts = [f"{name}[{i}]" for i in range(4) if f"{name}[{i}]" in data]
    return np.stack([data[part] for part in parts], axis=1)


def fields(log, topic, names):
    return np.concatenate([field(log, topic, name) for name in names], axis=1)


def check_px4(log, trace):
    """PX4's topics say what ours say, in PX4's axes."""
    def vector(name):
        return trace.array(name, 3)

    local, setpoint = "vehicle_local_position", "vehicle_local_position_setpoint"
    single = np.float32
    for topic, prefix in [(local, ""), (setpoint, "reference_")]:
        same(topic, fields(log, topic, "xyz"), (vector(prefix + "position") @ NED).astype(single))
        velocity = fields(log, topic, ["vx", "vy", "vz"])
        same(topic, velocity, (vector(prefix + "velocity") @ NED).astype(single))
    for name in ["position", "velocity", "acceleration"]:
        wanted = (vector("reference_" + name) @ NED).astype(single)
        same(name, field(log, "trajectory_setpoint", name), wanted)
    rate = field(log, "vehicle_angular_velocity", "xyz")
    same("rate", rate, (vector("rate") @ FRD).astype(single))
    check_attitudes(log, trace)
    wanted = (vector("rate") - field(log, "gyrfalcon_errors", "rate")) @ FRD
    same("rate setpoint", fields(log, "vehicle_rates_setpoint", ["roll", "pitch", "yaw"]), wanted,
         RATE_ROUNDING)
    thrust = field(log, "vehicle_thrust_setpoint", "xyz")
    ratio = -trace.column("thrust") / thrust[:, 2]
    assert (thrust[:, :2] == 0).all() and np.ptp(ratio) < 1e-5 * ratio[0], "normalised thrust"
    limits = [log.initial_parameters.get(f"torque_max.{axis}") for axis in "xyz"]  # controller 2
    if None not in limits:
        wanted = vector("torque") / np.array(limits) @ FRD
        same("torque", field(log, "vehicle_torque_setpoint", "xyz"), wanted, ROUNDING)
    check_status(log, trace)
    return float(ratio.mean())


def check_status(log, trace):
    """The rotors share the thrust, and the flight is armed and along a trajectory."""
    motors = log.get_dataset("actuator_motors").data
    control = np.stack([motors[f"control[{i}]"] for i in range(12)], axis=1)
    assert np.isnan(control[:, 4:]).all() and np.isfinite(control[:, :4]).all(), "four rotors"
    # Where no rotor is at a limit; a rotor of the firmware's vehicle gives up to 4 N.
    free = ((control[:, :4] > 1e-3) & (control[:, :4] < 0.999)).all(axis=1)
    assert free.sum() > len(free) / 2, "at the rotors' limits most of the time"
    same("shared thrust", 4 * control[free, :4].sum(axis=1)[:, np.newaxis],
         trace.column("thrust")[free][:, np.newaxis], 1e-5)
    status = log.get_dataset("vehicle_status").data
    for name, value in [("arming_state", 2), ("nav_state", 14), ("vehicle_type", 1)]:
        assert (status[name] == value).all(), name


def check_attitudes(log, trace):
    attitude = matrices(trace.array("attitude", 4))
    error = matrices(trace.array("attitude_error", 4))
    said = matrices(field(log, "vehicle_attitude", "q"))
    same("attitude", said, NED @ attitude @ FRD, ROUNDING)
    said = matrices(field(log, "vehicle_attitude_setpoint", "q_d"))
    wanted = NED @ attitude @ np.swapaxes(error, 1, 2) @ FRD
    same("attitude setpoint", said, wanted, ROUNDING)
    # PX4's own helper makes a yaw of the quaternion; the topic brings one, too.
    PX4ULog(log).add_roll_pitch_yaw()
    yaw = log.get_dataset("vehicle_attitude").data["yaw"]
    heading = log.get_dataset("vehicle_local_position").data["heading"]
    off = np.angle(np.exp(1j * (yaw - heading)))
    assert np.abs(off).max() < 1e-5, f"heading: off by {np.abs(off).max()} rad"


def check_units(log):
    """Every field of every topic has a unit."""
    lines = dict(part[0].split(": ") for part in log.msg_info_multiple_dict["units"])
    for data in log.data_list:
        listed = [word.split(" [")[0] for word in lines[data.name].split(", ")]
        named = [entry.field_name.split("[")[0] for entry in data.field_data]
        assert ["timestamp"] + listed == list(dict.fromkeys(named)), f"{data.name}: {listed}"


def main():
    path, trace, every = sys.argv[1], sys.argv[2], int(sys.argv[3])
    log, trace = ULog(path), Trace(trace, every)
    assert not log.file_corruption and not log.dropouts, "damaged"
    for data in log.data_list:
        times = data.data["timestamp"].astype(np.int64)
        rising(data.name, times)
        same(f"{data.name}.timestamp", times, trace.micros())
        if "timestamp_sample" in data.data:
            assert (data.data["timestamp_sample"] == data.data["timestamp"]).all(), data.name
    trace.check(lambda topic, name: field(log, f"gyrfalcon_{topic}", name))
    check_units(log)
    thrust_max = check_px4(log, trace)
    print(json.dumps({
        "instants": len(trace),
        "topics": sorted(data.name for data in log.data_list),
        "thrust_max": thrust_max,
        "information": log.msg_info_dict,
        "toml": "".join(log.msg_info_multiple_dict["scenario_toml"][0]),
        "parameters": log.initial_parameters,
        "notes": [[note.log_level_str(), note.timestamp, note.message]
                  for note in log.logged_messages],
    }))


main()
