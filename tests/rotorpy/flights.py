"""Flights of this project's controllers in RotorPy's plant, against its SE(3) controller.

Plant, rotors, drag, wind, sensor noise, trajectories and integrator are RotorPy's; only the laws are ours. `docs/rotorpy.md` says
what is flown and has the table, which `--write` makes anew; without it the flights are compared with what `recorded.json` holds.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import gyrfalcon
import numpy as np
from gyrfalcon.rotorpy import GyrfalconController
from numpy.typing import NDArray
from rotorpy.controllers.quadrotor_control import SE3Control
from rotorpy.sensors.external_mocap import MotionCapture
from rotorpy.trajectories.circular_traj import ThreeDCircularTraj
from rotorpy.trajectories.hover_traj import HoverTraj
from rotorpy.trajectories.lissajous_traj import TwoDLissajous
from rotorpy.trajectories.minsnap import MinSnap
from rotorpy.vehicles import crazyflie_params, hummingbird_params
from rotorpy.vehicles.multirotor import Multirotor
from rotorpy.wind.default_winds import ConstantWind, NoWind, SinusoidWind

HERE = Path(__file__).resolve().parent
RATE = 500.0
"""Control rate (Hz), of every controller."""

VEHICLES = {"0.5 kg": hummingbird_params.quad_params, "0.03 kg": crazyflie_params.quad_params}
"""RotorPy's AscTec Hummingbird and Crazyflie, by mass."""

THEIRS = "SE(3)"
OURS = {"0.5 kg": ("controller 1", "controller 2"), "0.03 kg": ("controller 2",)}
"""Controller 1 has no gains for the small vehicle: its term `-eps_e` (34) is 1 N m, thousands of its torque."""

WANTED: dict[tuple[str, str], dict[str, Any]] = {
    ("0.5 kg", "controller 1"): {"attitude_bandwidth": 7.5, "heading_bandwidth": 7.5, "damping": 0.6},
    ("0.5 kg", "controller 2"): {"attitude_bandwidth": 9.0, "heading_bandwidth": 9.0, "damping": 0.7},
    ("0.03 kg", "controller 2"): {
        "attitude_bandwidth": 5.5,
        "heading_bandwidth": 5.5,
        "damping": 0.65,
        "margin": 0.3,
        "position_range": 0.1,
        "rotation_slope": 0.25,
    },
}
"""Of `tune`: the position's bandwidth of SE(3), attitudes with which noise makes no more torque than there."""

POSITION_BANDWIDTH = 2.5
"""That of SE(3), the root of its 6.5 1/s^2 (rad/s)."""

INTEGRAL = {"0.5 kg": (2.5, 3.0), "0.03 kg": (0.75, 1.5)}
"""Bound (m/s^2) and gain of the estimate of a lasting acceleration."""

LOST = 20.0
"""Distance from the reference (m) beyond which a vehicle is lost."""


@dataclass(frozen=True)
class Case:
    """A flight: what it flies, and what the controllers are not told."""

    name: str
    vehicle: str = "0.5 kg"
    trajectory: str = "circle"
    scale: float = 1.0
    """True mass and inertia over those that the controllers are told."""
    wind: str = "calm"
    lag: float | None = None
    """Time constant of the rotors (s); RotorPy's own if None."""
    noise: float = 0.0
    """Noise of position, velocity, attitude and rate over that of RotorPy's motion capture."""
    tilt_deg: float = 0.0
    """Roll angle at the start."""
    torque_max: float = math.inf
    """Limit of each component of the commanded torque (N m); `tune` is told for controller 2, the others are cut."""
    lead: bool = False
    """Whether our laws are given the lag of the rotors, with a lead filter to a quarter of it."""
    attitude_bandwidth: float | None = None
    """In place of that of `WANTED` (rad/s)."""
    duration: float = 8.0


Gains = dict[tuple[Case, str], dict[str, Any]]

UPSIDE_DOWN: dict[str, Any] = {"trajectory": "hover", "tilt_deg": 150.0, "duration": 12.0}

CASES = [
    Case("circle"),
    Case("circle, 1.2 of mass and inertia", scale=1.2),
    Case("circle, 0.8 of mass and inertia", scale=0.8),
    Case("circle, noise x 3", noise=3.0),
    Case("circle, rotors of 50 ms", lag=0.05),
    Case("circle, rotors of 20 ms", lag=0.02),
    Case("circle, rotors of 80 ms", lag=0.08),
    Case("circle, rotors of 80 ms, known", lag=0.08, lead=True),
    Case("circle, wind of 3 m/s", wind="steady"),
    Case("circle, gusts", wind="gusts"),
    Case("lemniscate", trajectory="lemniscate"),
    Case("lemniscate, 1.2 of mass and inertia", trajectory="lemniscate", scale=1.2),
    Case("lemniscate, 0.8 of mass and inertia", trajectory="lemniscate", scale=0.8),
    Case("lemniscate, noise x 1", trajectory="lemniscate", noise=1.0),
    Case("lemniscate, rotors of 35 ms", trajectory="lemniscate", lag=0.035),
    Case("waypoints", trajectory="waypoints"),
    Case("waypoints, 0.8 of mass and inertia", trajectory="waypoints", scale=0.8),
    Case("waypoints, gusts, noise x 1", trajectory="waypoints", wind="gusts", noise=1.0),
    Case("step of 1 m", trajectory="step"),
    Case("step of 1 m, 1.2 of mass and inertia", trajectory="step", scale=1.2),
    Case("step of 1 m, rotors of 80 ms", trajectory="step", lag=0.08),
    Case("step of 1 m, rotors of 80 ms, known", trajectory="step", lag=0.08, lead=True),
    Case("hover, wind of 3 m/s", trajectory="hover", wind="steady"),
    Case("hover, gusts", trajectory="hover", wind="gusts"),
    Case("hover from 150 degrees, torque within 0.25 N m", torque_max=0.25, **UPSIDE_DOWN),
    Case("hover from 150 degrees, torque within 0.05 N m", torque_max=0.05, attitude_bandwidth=5.0, **UPSIDE_DOWN),
    Case("circle", vehicle="0.03 kg"),
    Case("circle, 1.2 of mass and inertia", vehicle="0.03 kg", scale=1.2),
    Case("circle, 0.8 of mass and inertia", vehicle="0.03 kg", scale=0.8),
    Case("lemniscate, wind of 3 m/s", vehicle="0.03 kg", trajectory="lemniscate", wind="steady"),
    Case("step of 1/3 m", vehicle="0.03 kg", trajectory="step"),
    Case("hover, noise x 1", vehicle="0.03 kg", trajectory="hover", noise=1.0),
    Case("waypoints, rotors of 5 ms", vehicle="0.03 kg", trajectory="waypoints", lag=0.005),
]


@dataclass
class Result:
    """What a flight came to; errors in the second half."""

    error: float
    """Root mean square of the distance from the reference (m); infinite if the vehicle is lost."""
    torque: float
    """Root mean square of the torque of the rotors (N m)."""
    change: float
    """Root mean square of its change per tick (N m)."""


class Step:
    """A jump of the reference by `length` (m) along x in the middle of the flight: the way there counts, too."""

    def __init__(self, length: float, instant: float) -> None:
        self.length, self.instant = length, instant

    def update(self, t: float) -> dict[str, Any]:
        flat = dict(HoverTraj().update(t))
        flat["x"] = np.array([self.length if t >= self.instant else 0.0, 0.0, 0.0])
        return flat


def trajectory(case: Case) -> Any:
    # The small vehicle has thrust of twice its weight only, and flies a third of the way.
    size = 1.0 if case.vehicle == "0.5 kg" else 1.0 / 3.0
    if case.trajectory == "circle":
        turn = 1.2 / (2.0 * np.pi)
        return ThreeDCircularTraj(radius=size * np.array([1.5, 1.5, 0.0]), freq=np.full(3, turn))
    if case.trajectory == "lemniscate":
        return TwoDLissajous(A=1.5 * size, B=0.75 * size, a=0.8, b=1.6, delta=np.pi / 2.0)
    if case.trajectory == "waypoints":
        points = [[0, 0, 0], [2, 0, 1], [2, 2, 0], [0, 2, 1], [0, 0, 0], [2, 0, 1], [2, 2, 0]]
        yaw = np.zeros(len(points))
        return MinSnap(size * np.array(points, float), yaw_angles=yaw, v_avg=1.2 * size, verbose=False)
    if case.trajectory == "step":
        return Step(size, 0.5 * case.duration)
    return HoverTraj()


def wind(case: Case) -> Any:
    if case.wind == "steady":
        return ConstantWind(3.0, 0.0, 0.0)
    if case.wind == "gusts":
        return SinusoidWind(amplitudes=[2.0, 1.5, 0.5], frequencies=[0.3, 0.5, 0.8])
    return NoWind()


def vehicle_file(case: Case, law: str) -> str:
    """What `tune` is told: mass and inertia to 20 %, thrust and torque of the rotors for controller 2."""
    told = VEHICLES[case.vehicle]
    small = case.vehicle == "0.03 kg"
    mass = told["mass"]
    inertia = nominal_inertia(told)
    limits = ""
    if law == "controller 2":
        thrust = told["k_eta"] * told["rotor_speed_max"] ** 2
        arm = abs(next(iter(told["rotor_pos"].values()))[0])
        turn = told["k_m"] * told["rotor_speed_max"] ** 2
        torque = [float(min(x, case.torque_max)) for x in (thrust * arm, thrust * arm, turn)]
        limits = f"thrust_max = {4.0 * thrust}\ntorque_max = {torque}\n"
    torque = [float(x) for x in (2e-6 if small else 2e-3) * inertia / inertia[0]]
    return f"""
name = "rotorpy"
mass = {{ lower = {0.8 * mass}, upper = {1.2 * mass} }}
inertia = {{ lower = {[float(x) for x in 0.8 * inertia]}, upper = {[float(x) for x in 1.2 * inertia]} }}
disturbance_acceleration = {0.02 if small else 0.2}
disturbance_torque = {torque}
reference_acceleration_max = {0.9 if small else 2.6}
step_period = {1.0 / RATE}
{limits}"""


def nominal_inertia(told: dict[str, Any]) -> NDArray[np.float64]:
    """Principal moments of a rigid body: RotorPy's Crazyflie is none, by 1 %."""
    x, y, z = (told[axis] for axis in ("Ixx", "Iyy", "Izz"))
    return np.array([x, y, min(z, x + y)])


def tuned(case: Case, law: str) -> dict[str, Any]:
    """The controller that `tune` makes for a vehicle, with the first estimates that SE(3) has, and integral action."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "vehicle.toml"
        path.write_text(vehicle_file(case, law))
        wanted: dict[str, Any] = {"position_bandwidth": POSITION_BANDWIDTH, "attitude_range": 0.05, "position_range": 0.3}
        wanted |= WANTED[case.vehicle, law]
        if case.attitude_bandwidth is not None:
            wanted |= {"attitude_bandwidth": case.attitude_bandwidth, "heading_bandwidth": case.attitude_bandwidth}
        proposal = gyrfalcon.tune(path, check=False, **wanted)
    controller = dict(proposal.scenario.controller)
    bound, gain = INTEGRAL[case.vehicle]
    told = VEHICLES[case.vehicle]
    of_law = next(iter(controller.values()))
    of_law["initial"] = {"mass": told["mass"], "inertia": [float(x) for x in nominal_inertia(told)]}
    of_law["integral"] = {"acceleration_max": bound, "gamma_d": gain, "torque_max": 0.0, "gamma_t": 0.0}
    if case.lead and case.lag is not None:
        of_law["rotors"] = {"lag": case.lag, "residual_lag": 0.25 * case.lag}
    return controller


def controller(case: Case, law: str, gains: Gains) -> Any:
    told = VEHICLES[case.vehicle]
    if law == THEIRS:
        return SE3Control(told)
    return GyrfalconController(gains[same_gains(case), law], told)


def same_gains(case: Case) -> Case:
    """What the gains depend on, of a case."""
    lag = case.lag if case.lead else None
    limits: dict[str, Any] = {"torque_max": case.torque_max, "attitude_bandwidth": case.attitude_bandwidth}
    return Case("", vehicle=case.vehicle, lead=case.lead, lag=lag, **limits)


def within(command: dict[str, Any], case: Case, vehicle: Multirotor) -> dict[str, Any]:
    """The command with its torque cut to the case's limit."""
    if math.isinf(case.torque_max):
        return command
    torque = np.clip(command["cmd_moment"], -case.torque_max, case.torque_max)
    forces = vehicle.TM_to_f @ np.concatenate([[command["cmd_thrust"]], torque])
    return {"cmd_motor_speeds": np.sign(forces) * np.sqrt(np.abs(forces) / vehicle.k_eta)}


def fly(case: Case, law: str, gains: Gains) -> Result:
    """One flight by RotorPy's parts, in the order of its `simulate`."""
    told = VEHICLES[case.vehicle]
    inertia = {axis: case.scale * told[axis] for axis in ("Ixx", "Iyy", "Izz")}
    true = {**told, **inertia, "mass": case.scale * told["mass"], "tau_m": case.lag or told["tau_m"]}
    path, air = trajectory(case), wind(case)
    np.random.seed(7)
    wanted = path.update(0.0)
    half_tilt = np.radians(0.5 * case.tilt_deg)
    hover = np.sqrt(true["mass"] * 9.81 / 4.0 / told["k_eta"])
    state = {
        "x": np.array(wanted["x"], float),
        "v": np.array(wanted["x_dot"], float),
        "q": np.array([np.sin(half_tilt), 0.0, 0.0, np.cos(half_tilt)]),
        "w": np.zeros(3),
        "wind": np.zeros(3),
        "rotor_speeds": np.full(4, hover),
    }
    # The integrator is RotorPy's solve_ivp; errors agree with its default RK45 to a part in a million.
    vehicle = Multirotor(true, initial_state=state, integrator_kwargs={"method": "RK23", "first_step": 1.0 / RATE})
    density = {"pos": 5e-4, "vel": 5e-3, "att": 5e-4, "rate": 5e-4}
    noise = {f"{name}_noise_density": case.noise * value * np.ones(3) for name, value in density.items()}
    quiet = {"vel_artifact_max": 0.0, "vel_artifact_prob": 0.0, "rate_artifact_max": 0.0, "rate_artifact_prob": 0.0}
    sensor = MotionCapture(RATE, mocap_params={**noise, **quiet})
    law_of_flight = controller(case, law, gains)
    steps = round(case.duration * RATE)
    errors, torques = np.full(steps, np.inf), np.zeros((steps, 3))
    for tick in range(steps):
        now = tick / RATE
        wanted = path.update(now)
        seen = sensor.measurement(state, with_noise=True) if case.noise else state
        command = within(law_of_flight.update(now, seen, wanted), case, vehicle)
        errors[tick] = np.linalg.norm(state["x"] - wanted["x"])
        torques[tick] = (vehicle.f_to_TM @ (told["k_eta"] * state["rotor_speeds"] ** 2))[1:]
        if not errors[tick] < LOST:
            return Result(np.inf, np.inf, np.inf)
        state["wind"] = air.update(now, state["x"])
        state = vehicle.step(state, command, 1.0 / RATE)
    half = steps // 2

    def rms(rows: NDArray[np.float64]) -> float:
        return float(np.sqrt(np.mean(np.sum(rows.reshape(len(rows), -1) ** 2, axis=1))))

    return Result(rms(errors[half:]), rms(torques[half:]), rms(np.diff(torques[half:], axis=0)))


RECORDED = HERE / "recorded.json"
PAGE = HERE.parents[1] / "docs" / "rotorpy.md"
BEGIN, END = "<!-- table: tests/rotorpy/flights.py --write -->", "<!-- end of the table -->"

TOLERANCE = 0.1
"""Part by which error and torque may exceed what is recorded: versions of NumPy and SciPy round differently, noise does not average out."""
FLOOR = 1e-3
"""Error (m) that counts as none."""

TORQUE_FLOOR = 1e-6
"""Torque (N m) that counts as none."""

WHY_ERROR = {
    "step": "error: (19) and (54) bound the acceleration that a jump may ask for, SE(3)'s has no bound",
    "noise": "error: mass adaptation and integral action pass on slow noise, 1.7 of the 2.1 mm more; SE(3) has neither",
    "lag": "error: the attitude is slower than SE(3)'s, for equal torque under noise",
}
WHY_TORQUE = {
    "gusts": "torque: integral action works against the gust",
    "lag": "torque: the attitude of controller 1 rings behind such rotors; `tune`, if told, refuses the gains; a lead filter helps",
    "other": "torque: mass adaptation and integral action work against what is not known",
}
"""Reasons for rows in which SE(3) has less error, or by more than the tolerance less torque."""


def flights(laws_of_others: bool, only: str) -> list[tuple[Case, str]]:
    """The flights whose key has `only` in it."""
    laws = [(case, law) for case in CASES for law in OURS[case.vehicle]]
    others = [(case, THEIRS) for case in CASES] if laws_of_others else []
    return [flight for flight in laws + others if only in key(*flight)]


def key(case: Case, law: str) -> str:
    return f"{case.vehicle}: {case.name}: {law}"


def fly_all(selected: list[tuple[Case, str]]) -> dict[str, Result]:
    needed = {(same_gains(case), law) for case, law in selected if law != THEIRS}
    gains = {(case, law): tuned(case, law) for case, law in needed}
    with multiprocessing.Pool() as pool:
        results = pool.starmap(fly, [(case, law, gains) for case, law in selected], chunksize=1)
    return {key(case, law): result for (case, law), result in zip(selected, results, strict=True)}


def reasons(case: Case, ours: list[Result], theirs: Result) -> str:
    """What SE(3) is better at in a case, and why."""
    found = []
    if any(result.error > max(theirs.error, FLOOR) for result in ours):
        found.append(WHY_ERROR["step" if case.trajectory == "step" else "noise" if case.noise else "lag"])
    if any(result.torque > max((1.0 + TOLERANCE) * theirs.torque, TORQUE_FLOOR) for result in ours):
        found.append(WHY_TORQUE["gusts" if case.wind == "gusts" else "lag" if case.lag else "other"])
    return "; ".join(found)


def cell(result: Result, best: bool) -> str:
    if not math.isfinite(result.error):
        return "lost"
    error = f"{1e3 * result.error:.1f}"
    torque = f"{1e3 * result.torque:.3g}"
    return f"**{error}** / {torque}" if best else f"{error} / {torque}"


def table(results: dict[str, Result]) -> str:
    """Rows of Markdown: error in mm and torque in mN m, the smallest error in bold."""
    lines = [
        "| flight | SE(3) | controller 1 | controller 2 | where SE(3) is better |",
        "|---|---|---|---|---|",
    ]
    for case in CASES:
        of_case = {law: results[key(case, law)] for law in (THEIRS, *OURS[case.vehicle])}
        least = min(result.error for result in of_case.values())
        cells = [cell(of_case[law], of_case[law].error == least) if law in of_case else "-" for law in COLUMNS]
        why = reasons(case, [of_case[law] for law in OURS[case.vehicle]], of_case[THEIRS])
        lines.append(f"| {case.vehicle}, {case.name} | {' | '.join(cells)} | {why} |")
    return "\n".join(lines)


COLUMNS = (THEIRS, "controller 1", "controller 2")


def recorded() -> dict[str, Result]:
    return {name: Result(**values) for name, values in json.loads(RECORDED.read_text()).items()}


def write(only: str) -> None:
    """Flies every law and keeps it: results, and the table of the page."""
    results = fly_all(flights(laws_of_others=True, only=only))
    if only:
        results = recorded() | results
    rounded = {
        name: {quantity: float(f"{value:.4g}") for quantity, value in asdict(result).items()}
        for name, result in sorted(results.items())
    }
    RECORDED.write_text(json.dumps(rounded, indent=1) + "\n")
    before, rest = PAGE.read_text().split(BEGIN)
    _, after = rest.split(END)
    PAGE.write_text(f"{before}{BEGIN}\n{table(recorded())}\n{END}{after}")


def check(only: str) -> list[str]:
    """Flies our laws; the rows that are worse than recorded, and the page if its table is another."""
    kept = recorded()
    faults = []
    for name, result in fly_all(flights(laws_of_others=False, only=only)).items():
        before = kept[name]
        limits = {
            "error": (result.error, max((1.0 + TOLERANCE) * before.error, FLOOR)),
            "torque": (result.torque, (1.0 + TOLERANCE) * before.torque),
        }
        faults += [f"{name}: {what} {is_now:.4g}, at most {most:.4g}" for what, (is_now, most) in limits.items() if not is_now <= most]
    if table(kept) not in PAGE.read_text():
        faults.append(f"{PAGE.name} has another table than {RECORDED.name}: run with --write")
    return faults


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="keep what is flown, and make the table anew")
    parser.add_argument("--only", default="", metavar="TEXT", help="only flights with this text in vehicle, name or law")
    arguments = parser.parse_args()
    begun = time.monotonic()
    faults: list[str] = []
    if arguments.write:
        write(arguments.only)
    else:
        faults = check(arguments.only)
    for fault in faults:
        print(fault)
    print(f"{'FAILED' if faults else 'passed'} after {time.monotonic() - begun:.0f} s")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
