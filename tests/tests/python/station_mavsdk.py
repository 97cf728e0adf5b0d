"""A MAVSDK script against a vehicle: prints the name of every step that it passed, as JSON.

Arguments: connection URL, directory for the downloaded log; without the latter the vehicle keeps no logs.
"""

import json
import math
import sys
import threading
import time

from mavsdk import Mavsdk, Configuration, ComponentType
from mavsdk.plugins.action import Action, ActionError
from mavsdk.plugins.info import Info
from mavsdk.plugins.log_files import LogFiles, LogFilesError, LogFilesResult
from mavsdk.plugins.mission import Mission, MissionItem, MissionPlan
from mavsdk.plugins.offboard import (
    AccelerationNed, Offboard, OffboardError, PositionNedYaw, VelocityBodyYawspeed, VelocityNedYaw,
)
from mavsdk.plugins.param import Param, ParamError
from mavsdk.plugins.telemetry import FlightMode, LandedState, Telemetry

PASSED = []


def step(name, condition, detail=""):
    if not condition:
        raise SystemExit(f"{name}: {detail}; passed: {PASSED}")
    PASSED.append(name)


def until(condition, seconds):
    """Waits for a condition; False if it does not come true in time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return False


def refused(call, kinds):
    try:
        call()
    except kinds as error:
        return str(error)
    return None


def near(north, east, up, radius):
    """Whether the vehicle is near a place relative to the one where it started."""
    def check():
        p = telemetry.position_velocity_ned().position
        return math.dist((p.north_m - start[0], p.east_m - start[1], start[2] - p.down_m),
                         (north, east, up)) < radius
    return check


url, directory = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else None
mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
mavsdk.add_any_connection(url)
system = mavsdk.first_autopilot(10.0)
step("discovery", system is not None)
telemetry, action, param = Telemetry(system), Action(system), Param(system)
offboard, mission, info, logs = Offboard(system), Mission(system), Info(system), LogFiles(system)
step("connected", until(system.is_connected, 5))
step("health", until(telemetry.health_all_ok, 10), telemetry.health())
step("identification", info.get_version() is not None)

step("position", until(lambda: abs(telemetry.position().latitude_deg) > 1, 5))
step("attitude", until(lambda: math.isfinite(telemetry.attitude_euler().yaw_deg), 5))
step("quaternion", until(lambda: telemetry.attitude_quaternion().w != 0, 5))
step("local position", until(lambda: telemetry.position_velocity_ned() is not None, 5))
step("home", until(lambda: abs(telemetry.home().latitude_deg) > 1, 5))
step("fix", until(lambda: telemetry.gps_info().fix_type > 1, 5), telemetry.gps_info())
step("on the ground", until(lambda: telemetry.landed_state() == LandedState.ON_GROUND, 5))
step("not armed", not telemetry.armed() and not telemetry.in_air())
p = telemetry.position_velocity_ned().position
start = (p.north_m, p.east_m, p.down_m)

names = [parameter.name for parameter in param.get_all_params().float_params]
step("parameter list", "CTL_K1" in names and "MIS_TAKEOFF_ALT" in names, names)
k1 = param.get_param_float("CTL_K1")
param.set_param_float("CTL_K1", k1 * 0.75)
step("parameter write", abs(param.get_param_float("CTL_K1") - k1 * 0.75) < 1e-6)
param.set_param_float("CTL_K1", k1)
error = refused(lambda: param.set_param_float("CTL_M1", 999.0), ParamError)
step("parameter refused", error is not None or param.get_param_float("CTL_M1") < 999)
step("parameter unknown", refused(lambda: param.get_param_float("NO_SUCH_NAME"), ParamError))
action.set_takeoff_altitude(2.0)
param.set_param_float("COM_OF_LOSS_T", 5.0)  # a busy machine may be silent for longer than half a second
step("take-off altitude", action.get_takeoff_altitude() == 2.0)

step("take-off refused", refused(action.takeoff, ActionError))
action.arm()
step("armed", until(telemetry.armed, 5))
action.takeoff()
step("in air", until(telemetry.in_air, 30))
step("take-off height", until(near(0, 0, 2, 0.3), 60), telemetry.position_velocity_ned())
step("hold", until(lambda: telemetry.flight_mode() == FlightMode.HOLD, 20), telemetry.flight_mode())
step("disarm in flight refused", refused(action.disarm, ActionError))

here = telemetry.position()
metre = 1 / 111_319.49
action.goto_location(here.latitude_deg + 3 * metre, here.longitude_deg, here.absolute_altitude_m, 0)
step("goto", until(near(3, 0, 2, 0.4), 60), telemetry.position_velocity_ned())
step("speed refused", refused(lambda: action.set_current_speed(99.0), ActionError))
action.set_current_speed(1.0)

step("offboard refused", refused(offboard.start, OffboardError))
n, e, d = start
offboard.set_position_ned(PositionNedYaw(n, e + 2, d - 3, 90.0))
offboard.start()
step("offboard", offboard.is_active())
step("offboard mode", until(lambda: telemetry.flight_mode() == FlightMode.OFFBOARD, 10),
     telemetry.flight_mode())
step("offboard position", until(near(0, 2, 3, 0.3), 60), telemetry.position_velocity_ned())
offboard.set_velocity_ned(VelocityNedYaw(0.5, 0.0, 0.0, 90.0))
velocity = lambda: telemetry.position_velocity_ned().velocity
step("offboard velocity", until(lambda: abs(velocity().north_m_s - 0.5) < 0.1, 30), velocity())
offboard.set_velocity_body(VelocityBodyYawspeed(0.4, 0.0, 0.0, 0.0))
step("offboard body velocity", until(lambda: abs(velocity().east_m_s - 0.4) < 0.1
                                     and abs(velocity().north_m_s) < 0.1, 30), velocity())
offboard.set_acceleration_ned(AccelerationNed(0.0, 0.0, -0.05))
step("offboard acceleration", until(lambda: velocity().down_m_s < -0.1, 30), velocity())
offboard.stop()
step("offboard stopped", until(lambda: telemetry.flight_mode() == FlightMode.HOLD, 10))
step("stands still", until(lambda: abs(velocity().down_m_s) < 0.05, 20), velocity())


def waypoint(north, east, up):
    home = telemetry.home()
    shrink = math.cos(math.radians(home.latitude_deg))
    return MissionItem(
        latitude_deg=home.latitude_deg + north * metre,
        longitude_deg=home.longitude_deg + east * metre / shrink, relative_altitude_m=up,
        speed_m_s=1.5, is_fly_through=True, vehicle_action=MissionItem.VehicleAction.NONE,
        camera_action=MissionItem.CameraAction.NONE)


plan = MissionPlan([waypoint(0, 0, 3), waypoint(2, 0, 3), waypoint(2, 2, 2)])
progress = []
mission.subscribe_mission_progress(lambda seen, _: progress.append((seen.current, seen.total)))
mission.set_return_to_launch_after_mission(False)
mission.upload_mission(plan)
back = mission.download_mission().mission_items
step("mission downloaded", len(back) == 3 and abs(back[1].relative_altitude_m - 3) < 1e-3)
mission.start_mission()
step("mission started", until(lambda: telemetry.flight_mode() == FlightMode.MISSION, 10))
step("mission paused", mission.pause_mission() is not None
     and until(lambda: telemetry.flight_mode() == FlightMode.HOLD, 10))
mission.start_mission()
step("mission flown to its end", until(mission.is_mission_finished, 120), progress)
step("at the last waypoint", until(near(2, 2, 2, 0.5), 20), telemetry.position_velocity_ned())

action.return_to_launch()
step("return", until(lambda: telemetry.flight_mode() == FlightMode.RETURN_TO_LAUNCH, 10))
action.hold()
step("hold again", until(lambda: telemetry.flight_mode() == FlightMode.HOLD, 10))
action.land()
step("land", until(lambda: not telemetry.in_air(), 60), telemetry.landed_state())
step("disarmed by itself", until(lambda: not telemetry.armed(), 20))
action.arm()
step("armed again", until(telemetry.armed, 5))
action.disarm()
step("disarmed", until(lambda: not telemetry.armed(), 5))


def download():
    """Fetches the first log; its length."""
    entries = logs.get_entries()
    step("log list", len(entries) >= 1 and entries[0].size_bytes > 100_000, entries)
    done, finished = [], threading.Event()

    def on_progress(result, progress, _):
        if result != LogFilesResult.NEXT:
            done.append(result)
            finished.set()

    logs.download_log_file_async(entries[0], f"{directory}/downloaded.ulg", on_progress)
    step("log downloaded", finished.wait(120) and done == [LogFilesResult.SUCCESS], done)
    return entries[0].size_bytes


size = 0
if directory is None:
    step("no logs", refused(logs.get_entries, LogFilesError))
else:
    size = download()
print(json.dumps({"steps": PASSED, "size": size}))
mavsdk.destroy()
