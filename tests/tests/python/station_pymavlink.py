"""A pymavlink script against a vehicle: prints the name of every step that it passed, as JSON.

Argument: where the vehicle is, as pymavlink takes it: `udpin:127.0.0.1:14550`, `tcp:127.0.0.1:5760`.
"""

import json
import math
import os
import sys
import time

os.environ["MAVLINK20"] = "1"  # before the import, which otherwise speaks version 1

from pymavlink import mavutil
from pymavlink.dialects.v20 import common as mav

PASSED = []
NAN = math.nan


def step(name, condition, detail=""):
    if not condition:
        raise SystemExit(f"{name}: {detail}; passed: {PASSED}")
    PASSED.append(name)


def connect():
    link = mavutil.mavlink_connection(place, source_system=250, dialect="common")
    return link


def receive(kind, seconds=10, condition=lambda message: True):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        message = link.recv_match(type=kind, blocking=True, timeout=0.2)
        if message is not None and condition(message):
            return message
    return None


def command(number, *parameters, system=1):
    parameters = list(parameters) + [0] * (7 - len(parameters))
    link.mav.command_long_send(system, 1, number, 0, *parameters)
    answer = receive("COMMAND_ACK", 3, lambda ack: ack.command == number)
    return None if answer is None else answer.result


def said(text, seconds=5):
    return receive("STATUSTEXT", seconds, lambda message: text in message.text)


def mode():
    """Main and sub-mode of the next heartbeat."""
    custom = receive("HEARTBEAT").custom_mode
    return custom >> 16 & 0xff, custom >> 24


def armed():
    return bool(receive("HEARTBEAT").base_mode & mav.MAV_MODE_FLAG_SAFETY_ARMED)


def velocity_target(north, east, down):
    link.mav.set_position_target_local_ned_send(
        0, 1, 1, mav.MAV_FRAME_LOCAL_NED, 0b110111000111, 0, 0, 0, north, east, down, 0, 0, 0, 0, 0)


place = sys.argv[1]
link = connect()
step("heartbeat", receive("HEARTBEAT") is not None)
heartbeat = receive("HEARTBEAT")
step("generic autopilot", heartbeat.autopilot == mav.MAV_AUTOPILOT_GENERIC, heartbeat)
step("health", receive("SYS_STATUS", 10, lambda m: m.onboard_control_sensors_health >> 28 & 1))

link.mav.timesync_send(0, 1234)
step("time", receive("TIMESYNC", 5, lambda m: m.ts1 == 1234 and m.tc1 > 0) is not None)
link.mav.ping_send(1, 5, 0, 0)
step("ping", receive("PING", 5, lambda m: m.seq == 5) is not None)

link.mav.param_request_list_send(1, 1)
values = {}
while len(values) < 1 or len(values) < next(iter(values.values())).param_count:
    value = receive("PARAM_VALUE", 5)
    step("parameter arrives", value is not None, len(values)) if value is None else None
    values[value.param_id] = value
step("parameter list", "CTL_K1" in values and all(len(name) <= 16 for name in values))
link.mav.param_set_send(1, 1, b"CTL_K1", 1e6, mav.MAV_PARAM_TYPE_REAL32)
error = receive("PARAM_ERROR", 5)
step("refusal explained", error is not None and error.error == mav.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)
kept = receive("PARAM_VALUE", 5)
step("value in force echoed", kept is not None and kept.param_value == values["CTL_K1"].param_value)
link.mav.param_request_read_send(1, 1, b"NO_SUCH_NAME", -1)
error = receive("PARAM_ERROR", 5)
step("unknown parameter", error is not None and error.error == mav.MAV_PARAM_ERROR_DOES_NOT_EXIST)

for number, kind in [(148, "AUTOPILOT_VERSION"), (242, "HOME_POSITION"), (300, "UNKNOWN_300"),
                     (435, "UNKNOWN_435")]:  # its dialect lacks the last two
    link.mav.command_long_send(1, 1, 512, 0, number, 0, 0, 0, 0, 0, 0)
    step(f"message {number}", receive(kind, 5) is not None)
step("protocol and capabilities", command(519, 1) == 0 and command(520, 1) == 0)
step("rate", command(511, 30, 100_000) == 0)
link.mav.file_transfer_protocol_send(0, 1, 1, [1, 0, 0, 4] + [0] * 247)
answer = receive("FILE_TRANSFER_PROTOCOL", 5)
step("files refused at once", answer is not None and answer.payload[3] == 129)

link.mav.command_long_send(2, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
step("another system's command is ignored", not armed() and receive("COMMAND_ACK", 0.5) is None)
step("manual refused", command(176, 1, 1, 0) == mav.MAV_RESULT_UNSUPPORTED)
step("take-off refused", command(22, NAN, NAN, NAN, NAN, NAN, NAN, NAN) == 1)

step("armed", command(400, 1) == 0 and armed())
step("take-off", command(22, NAN, NAN, NAN, NAN, NAN, NAN, 2.0) == 0)
step("in air", receive("EXTENDED_SYS_STATE", 30, lambda m: m.landed_state == 2) is not None)
step("height", receive("LOCAL_POSITION_NED", 60, lambda m: abs(m.z + 2) < 0.3) is not None)

link.mav.set_attitude_target_send(0, 1, 1, 0, [1, 0, 0, 0], 0, 0, 0, 0.5)
step("attitude set-point refused", said("attitude alone") is not None)
velocity_target(NAN, 0, 0)
step("NaN refused", said("set-point refused") is not None)
step("offboard refused", command(176, 1, 6, 0) == 1)
velocity_target(0.5, 0, 0)
step("offboard", command(176, 1, 6, 0) == 0)
end = time.monotonic() + 20
fast = False
while time.monotonic() < end and not fast:
    velocity_target(0.5, 0, 0)
    fast = receive("LOCAL_POSITION_NED", 0.05, lambda m: abs(m.vx - 0.5) < 0.1) is not None
step("offboard velocity", fast)

link.close()  # the link is lost
time.sleep(1.5)
link = connect()
step("link back", receive("HEARTBEAT", 10) is not None)
step("hold after silence", mode() == (4, 3))
step("stands still", receive("LOCAL_POSITION_NED", 20, lambda m: abs(m.vx) < 0.05) is not None)

home = receive("HOME_POSITION")
metre = 1e7 / 111_319.49
items = [(22, 0, 0, 3), (178, 0, 0, 0), (16, 2, 0, 3), (16, 2, 2, 2), (21, 1, 1, 0)]
link.mav.mission_count_send(1, 1, len(items), 0)
acknowledged = None
while acknowledged is None:
    message = receive(["MISSION_REQUEST_INT", "MISSION_ACK"], 5)
    step("upload goes on", message is not None) if message is None else None
    if message.get_type() == "MISSION_ACK":
        acknowledged = message.type
        break
    number, north, east, up = items[message.seq]
    link.mav.mission_item_int_send(
        1, 1, message.seq, mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, number, 0, 1, 0, 1.5, 0, NAN,
        int(home.latitude + north * metre),
        int(home.longitude + east * metre / math.cos(math.radians(home.latitude * 1e-7))), up, 0)
step("mission accepted", acknowledged == 0, acknowledged)
step("mission started", command(300, 0, 0) == 0)
reached = []
while len(reached) < len(items):
    message = receive("MISSION_ITEM_REACHED", 90)
    step("mission goes on", message is not None, reached) if message is None else None
    reached.append(message.seq)
step("mission flown to its end", reached == list(range(len(items))), reached)
step("landed and disarmed", receive("HEARTBEAT", 10, lambda m: not m.base_mode & 128) is not None)

link.mav.mission_count_send(1, 1, 3, 0)  # and never an item
cut = receive("MISSION_ACK", 20)
step("upload cut short ends", cut is not None and cut.type == mav.MAV_MISSION_OPERATION_CANCELLED)
link.mav.mission_request_list_send(1, 1, 0)
step("old mission kept", receive("MISSION_COUNT", 5).count == len(items))
for _ in range(2_000):
    link.mav.param_request_list_send(1, 1)
step("alive after a flood", receive("HEARTBEAT", 5) is not None and not armed())
print(json.dumps({"steps": PASSED}))
