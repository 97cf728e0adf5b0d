"""Signatures of MAVLink 2 by pymavlink, against a vehicle with a key: prints every step that passed, as JSON.

Arguments: TCP address of the vehicle, its key in hexadecimal digits, and for a vehicle that takes no key over this line
a file: what was sent is kept there, or sent again if it is there already, from before a restart of the vehicle.
"""

import json
import os
import sys
import time

os.environ["MAVLINK20"] = "1"  # before the import, which otherwise speaks version 1

from pymavlink import mavutil

PASSED = []
FIRST = bytes.fromhex(sys.argv[2])
SECOND = bytes(reversed(FIRST))


def step(name, condition, detail=""):
    if not condition:
        raise SystemExit(f"{name}: {detail}; passed: {PASSED}")
    PASSED.append(name)


def connect(key=None, link_id=0, clock=None):
    host, port = sys.argv[1].rsplit(":", 1)
    link = mavutil.mavlink_connection(f"tcp:{host}:{port}", source_system=250, dialect="common")
    if key is not None:
        link.setup_signing(key, link_id=link_id, initial_timestamp=clock)
    return link


def receive(link, kind, seconds=5, condition=lambda message: True):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        message = link.recv_match(type=kind, blocking=True, timeout=0.2)
        if message is not None and condition(message):
            return message
    return None


def arm(link, value=1):
    """The result of an arm, or none if there is no answer."""
    link.mav.command_long_send(1, 1, 400, 0, value, 0, 0, 0, 0, 0, 0)
    answer = receive(link, "COMMAND_ACK", 2, lambda ack: ack.command == 400)
    return None if answer is None else answer.result


def drain(link):
    """Drops what has come: answers go to every station."""
    while receive(link, "COMMAND_ACK", 0.3) is not None:
        pass


KEPT = sys.argv[3] if len(sys.argv) > 3 else None
if KEPT and os.path.exists(KEPT):
    with open(KEPT) as file:
        before = [bytes.fromhex(line) for line in file]
    link = connect(FIRST, link_id=9)
    step("signed after the restart", receive(link, "HEARTBEAT").get_signed())
    # By another connection: the link's own numbers and times stay as they are.
    again = connect()
    for data in before:
        again.write(data)
    step("what was recorded before it is refused", receive(link, "COMMAND_ACK", 1.5) is None)
    step("unsigned is refused", arm(again) is None)
    step("what is new is carried out", arm(link) == 0 and arm(link, 0) == 0)
    print(json.dumps({"steps": PASSED}))
    sys.exit()

plain = connect()
heartbeat = receive(plain, "HEARTBEAT")
step("what is sent is signed", heartbeat.get_header().incompat_flags & 1 == 1)
step("unsigned is refused", arm(plain) is None)
said = connect()
told = None
for _ in range(8):  # it is told once in five seconds of the vehicle's time
    said.mav.command_long_send(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
    told = told or receive(said, "STATUSTEXT", 1.5, lambda m: "not signed" in m.text)
    if told:
        break
step("the refusal is told", told is not None)
said.close()

wrong = connect(SECOND)
step("another key is refused", arm(wrong) is None)
step("and reads nothing", receive(wrong, "HEARTBEAT", 2) is None)

link = connect(FIRST, link_id=3)
step("signatures of the vehicle are good", receive(link, "HEARTBEAT").get_signed())
sent = []
write = link.write
link.write = lambda data: (sent.append(bytes(data)), write(data))[1]
step("signed is carried out", arm(link) == 0)
step("disarmed", arm(link, 0) == 0)
for data in list(sent):
    write(data)
step("a replay is refused", receive(link, "COMMAND_ACK", 1.5) is None)
step("and does not arm", not receive(link, "HEARTBEAT").base_mode & 128)
step("what is new goes on", arm(link) == 0 and arm(link, 0) == 0)
other = connect(FIRST, link_id=4)
step("another link has its own time", arm(other) == 0 and arm(other, 0) == 0)
drain(link)
late = connect(FIRST, link_id=5, clock=link.mav.signing.timestamp - 120 * 100_000)
late.mav.command_long_send(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
step("a clock of two minutes ago is refused", receive(link, "COMMAND_ACK", 1.5) is None)

if KEPT:
    link.mav.setup_signing_send(1, 1, list(SECOND), link.mav.signing.timestamp)
    step("no key over a radio", receive(link, "STATUSTEXT", 5, lambda m: "not secure" in m.text) is not None)
    step("the key is as before", arm(link) == 0 and arm(link, 0) == 0)
    with open(KEPT, "w") as file:
        file.writelines(data.hex() + "\n" for data in sent)
    print(json.dumps({"steps": PASSED}))
    sys.exit()
link.mav.setup_signing_send(1, 1, list(SECOND), link.mav.signing.timestamp)
link.setup_signing(SECOND, link_id=6)
step("the key is replaced", arm(link) == 0)
step("not while armed", link.mav.setup_signing_send(1, 1, list(FIRST), 0) is None and arm(link, 0) == 0)
old = connect(FIRST, link_id=7)
step("the old key is worth nothing", arm(old) is None)
link.mav.setup_signing_send(1, 1, [0] * 32, 0)
time.sleep(0.5)
fresh = connect()
step("the key is removed", arm(fresh) == 0 and arm(fresh, 0) == 0)
step("and nothing is signed", receive(fresh, "HEARTBEAT").get_header().incompat_flags == 0)
print(json.dumps({"steps": PASSED}))
