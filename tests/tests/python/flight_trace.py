"""The trace of a flight, and how our topics in a log must agree with it, number by number."""

import csv

import numpy as np

AXES = {1: [""], 3: ["_x", "_y", "_z"], 4: ["_w", "_x", "_y", "_z"]}

# Topic, field and the trace's column, the axes of vectors and quaternions left out.
FIELDS = {
    "state": {"position": "position", "velocity": "velocity", "attitude": "attitude", "rate": "rate"},
    "reference": {
        "position": "reference_position",
        "velocity": "reference_velocity",
        "acceleration": "reference_acceleration",
        "left": "reference_left",
    },
    "errors": {"position": "position_error", "attitude": "attitude_error"},
    "wrench": {
        "thrust": "thrust",
        "torque_demand": "torque_demand",
        "torque": "torque",
        "applied_thrust": "applied_thrust",
        "applied_torque": "applied_torque",
        "modelled_torque": "modelled_torque",
    },
    "estimates": {
        "mass": "mass_estimate",
        "inertia": "inertia_estimate",
        "gyroscopic_ratio": "gyroscopic_ratio_estimate",
        "lasting_acceleration": "lasting_acceleration_estimate",
        "lasting_torque": "lasting_torque_estimate",
    },
    "auxiliary": {"attitude": "auxiliary_attitude", "rate": "auxiliary_rate"},
    "lyapunov": {"value": "lyapunov", "parameter_part": "lyapunov_parameters"},
    "status": {"tick": "tick", "bits": "status"},
}


class Trace:
    """Columns by name; every `every`-th row."""

    def __init__(self, path, every):
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        self.names = rows[0]
        self.rows = np.array(rows[1::every], dtype=np.float64)

    def __len__(self):
        return len(self.rows)

    def column(self, name):
        return self.rows[:, self.names.index(name)]

    def array(self, name, width):
        """The columns of a number (1), vector (3) or quaternion (4)."""
        return np.stack([self.column(name + axis) for axis in AXES[width]], axis=1)

    def micros(self):
        return np.rint(self.column("time") * 1e6).astype(np.int64)

    def check(self, read):
        """`read(topic, field)` gives an array, a row an instant, in the type of the log."""
        columns = {"time"}
        for topic, fields in FIELDS.items():
            for field, name in fields.items():
                logged = read(topic, field)
                wanted = self.array(name, logged.shape[1]).astype(logged.dtype)
                same(f"{topic}.{field}", logged, wanted)
                columns.update(name + axis for axis in AXES[logged.shape[1]])
        missing = set(self.names) - columns
        assert not missing, f"columns that no log was held against: {missing}"


def same(what, logged, wanted, tolerance=0.0):
    """Both arrays are equal, or as near as `tolerance`."""
    assert logged.shape == wanted.shape, f"{what}: {logged.shape} instead of {wanted.shape}"
    off = np.abs(logged.astype(np.float64) - wanted.astype(np.float64))
    worst = np.unravel_index(np.argmax(off), off.shape)
    assert off[worst] <= tolerance, f"{what}{[int(i) for i in worst]}: {logged[worst]}, not {wanted[worst]}"


def rising(what, times):
    """Times rise from one instant to the next."""
    assert (np.diff(times) > 0).all(), f"{what}: time does not rise"


def matrices(q):
    """Rotation matrices of quaternions, scalar first."""
    w, x, y, z = np.moveaxis(q.astype(np.float64), 1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
