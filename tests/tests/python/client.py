"""A client of the link that knows docs/protocol.md and nothing of the project's code.

    python3 client.py docs/protocol.md LINK

LINK: the FIFOs LINK.in and LINK.out of an emulated vehicle (docs/firmware.md), or tcp:PORT, where the
emulator puts the vehicle's serial port, for the link's own lock step. Framing
comes from the code printed in the page, so that the page itself is what is tested. Prints what
the vehicle said as one JSON object. Standard library only.
"""

import json
import os
import re
import select
import socket
import struct
import sys
import time

PATIENCE = 60.0  # longest wait for the vehicle [s]

COMMAND, PARAMETER_AT, PARAMETER_READ, PARAMETER_WRITE, SUBSCRIBE = 1, 8, 9, 10, 12
LOCK_STEP, STEP = 15, 16
COMMANDS = {"arm": 0, "disarm": 1, "start": 2, "stop": 3}
IDENTITY, ACKNOWLEDGEMENT, TELEMETRY, PARAMETER, HEALTH = 0, 1, 2, 3, 5
IN_FORCE, STEPPED, LASTING = 6, 7, 9
MODES = ["Disarmed", "Armed", "Flying", "Failsafe", "Locked"]
REFUSALS = ["not armed", "state stale", "tilted", "fault", "in failsafe", "locked"]
REJECTIONS = ["mode", "invalid", "unknown parameter", "no path", "wrong leg", "not now",
              "storage failed", "unsupported", "storage full"]
ORIGINS = ["built-in", "stored", "unreadable", "refused"]


def page(path):
    """The names that the page's Python block defines, and its example frames by their bytes."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    names = {}
    exec(re.search(r"```python\n(.*?)```", text, re.S).group(1), names)
    blocks = re.findall(r"\n\n((?:    [0-9a-f]{2}(?: [0-9a-f]{2})*\n)+)", text)
    return names, [bytes.fromhex(block) for block in blocks]


class Fields:
    """Takes the fields of a message one after the other."""

    def __init__(self, data):
        self.data, self.place = data, 0

    def take(self, length):
        taken = self.data[self.place:self.place + length]
        assert len(taken) == length, "message too short"
        self.place += length
        return taken

    def u8(self):
        return self.take(1)[0]

    def bool(self):
        return [False, True][self.u8()]

    def varint(self):
        value, shift = 0, 0
        while True:
            byte = self.u8()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value

    def floats(self, count):
        return list(struct.unpack(f"<{count}f", self.take(4 * count)))

    def f32(self):
        return self.floats(1)[0]

    def string(self):
        return self.take(self.varint()).decode()

    def end(self):
        assert self.place == len(self.data), "bytes after the message"


def rejection(fields):
    kind = REJECTIONS[fields.varint()]
    if kind == "mode":
        return {"kind": kind, "refusal": REFUSALS[fields.varint()]}
    if kind == "invalid":
        name = fields.string()
        value, lower, upper = fields.floats(3)
        return {"kind": kind, "name": name, "value": value, "lower": lower, "upper": upper}
    if kind == "wrong leg":
        return {"kind": kind, "expected": fields.u8()}
    return {"kind": kind}


def telemetry(fields):
    said = {"tick": fields.varint(), "mode": MODES[fields.varint()]}
    said["cause"] = fields.varint() if fields.u8() else None
    said["numbers"] = fields.floats(7)  # thrust, torque, torque before saturation
    said["status"], said["limited"] = fields.varint(), fields.u8()
    said["numbers"] += fields.floats(21)  # estimates, attitude error, auxiliary system
    said["cost"] = fields.varint()
    return said


def parse(message):
    """Kind and content of a message from the vehicle."""
    fields = Fields(message)
    kind = fields.varint()
    if kind == IDENTITY:
        said = {"firmware": fields.string(), "board": fields.string(),
                "controller": fields.varint(), "step_period": fields.f32(),
                "uptime": fields.varint(), "fault": fields.bool()}
    elif kind == ACKNOWLEDGEMENT:
        said = {"sequence": fields.varint()}
        said["rejection"] = rejection(fields) if fields.u8() else None
    elif kind == TELEMETRY:
        said = telemetry(fields)
    elif kind == PARAMETER:
        said = {"index": fields.varint(), "count": fields.varint(),
                "name": fields.string(), "value": fields.f32()}
    elif kind == HEALTH:
        said = [fields.varint() for _ in range(1 + 4 * 3 + 6 + 1)]
    elif kind == IN_FORCE:
        said = {"origin": ORIGINS[fields.varint()], "generation": fields.varint(),
                "changed": fields.bool()}
    elif kind == STEPPED:
        said = fields.varint()
    elif kind == LASTING:
        said = {"tick": fields.varint(), "numbers": fields.floats(9)}
    else:
        raise ValueError(f"message {kind} is not expected")
    fields.end()
    return kind, said


class Fifos:
    """Packets: each from the vehicle is answered by one to it."""

    def __init__(self, link):
        # Opened for both directions, neither side waits for the other to open.
        self.to_vehicle = os.open(link + ".in", os.O_RDWR)
        self.from_vehicle = os.open(link + ".out", os.O_RDWR)

    def read(self, length):
        data = b""
        while len(data) < length:
            if not select.select([self.from_vehicle], [], [], PATIENCE)[0]:
                raise TimeoutError("the vehicle is silent")
            data += os.read(self.from_vehicle, length - len(data))
        return data

    def send(self, data):
        os.write(self.to_vehicle, struct.pack("<H", len(data)) + data)

    def receive(self):
        return self.read(*struct.unpack("<H", self.read(2)))


class Wire:
    """The serial port: bytes whenever they come."""

    def __init__(self, port):
        end = time.monotonic() + PATIENCE
        while True:
            try:
                self.socket = socket.create_connection(("127.0.0.1", port), PATIENCE)
                break
            except ConnectionRefusedError:
                assert time.monotonic() < end, "no emulator"
                time.sleep(0.02)

    def send(self, data):
        self.socket.sendall(data)

    def receive(self):
        data = self.socket.recv(4096)
        assert data, "the emulator has gone"
        return data


class Vehicle:
    """A vehicle that goes on by one release of telemetry whenever something is said."""

    def __init__(self, names, line):
        self.names, self.line, self.sequence = names, line, 0
        self.pending = b""

    def listen(self):
        """What the vehicle has sent until its next release of telemetry."""
        return self.parse(self.line.receive())

    def parse(self, data):
        *frames, self.pending = (self.pending + data).split(b"\0")
        heard = []
        for frame in filter(None, frames):
            received = self.names["unframe"](frame)
            assert received is not None, f"a damaged frame: {frame.hex(' ')}"
            heard.append(parse(received[1]))
        return heard

    def frames(self, *messages):
        data = b""
        for message in messages:
            data += self.names["frame"](self.sequence, message)
            self.sequence = (self.sequence + 1) & 0xFFFF
        return data

    def say(self, *messages):
        self.line.send(self.frames(*messages))
        return self.listen()

    def ask(self, kind, *messages, wanted=lambda said: True):
        """The first answer of that kind to the first message; the others go with every packet."""
        heard = self.say(*messages)
        for _ in range(150):
            for found, said in heard:
                if found == kind and wanted(said):
                    return said
            heard = self.say(*messages[1:])
        raise TimeoutError("no answer")

    def obey(self, *messages):
        """None if the first message is obeyed, or the rejection."""
        sequence = self.sequence
        ours = lambda said: said["sequence"] == sequence
        return self.ask(ACKNOWLEDGEMENT, *messages, wanted=ours)["rejection"]


class SteppedVehicle(Vehicle):
    """A vehicle over a wire in the link's lock step: it goes on by one tick."""

    def __init__(self, names, line):
        super().__init__(names, line)
        self.greeting = self.listen_for(IN_FORCE)
        self.line.send(self.frames(bytes([LOCK_STEP, 1])))
        entered = self.listen_for(STEPPED)
        assert any(kind == ACKNOWLEDGEMENT and said["rejection"] is None for kind, said in entered)
        self.uptime = entered[-1][1]

    def listen_for(self, last):
        """What is said until a message of that kind."""
        heard = []
        while not heard or heard[-1][0] != last:
            heard += self.parse(self.line.receive())
        return heard

    def listen(self):
        greeting, self.greeting = self.greeting, None
        return greeting

    def say(self, *messages):
        self.uptime += 1
        step = bytes([STEP]) + self.names["varint"](self.uptime)
        self.line.send(self.frames(*messages) + b"\0" + self.frames(step))
        *heard, stepped = self.listen_for(STEPPED)
        assert stepped[1] == self.uptime
        return heard


def string(text):
    return bytes([len(text)]) + text.encode()


def parameters(vehicle):
    """The whole list: name and value."""
    found = []
    while True:
        ask = bytes([PARAMETER_AT]) + vehicle.names["varint"](len(found))
        said = vehicle.ask(PARAMETER, ask)
        assert said["index"] == len(found)
        found.append([said["name"], said["value"]])
        if len(found) == said["count"]:
            return found


def read(vehicle, name):
    return vehicle.ask(PARAMETER, bytes([PARAMETER_READ]) + string(name))["value"]


def write(vehicle, name, value):
    message = bytes([PARAMETER_WRITE]) + string(name) + struct.pack("<f", value)
    return vehicle.obey(message)


def converse(vehicle, written, refused, state):
    """The whole conversation; `state` is what the vehicle is told of itself."""
    results = {"greeting": vehicle.listen()}
    results["identity"] = vehicle.ask(IDENTITY, vehicle.names["HELLO"])
    results["parameters"] = parameters(vehicle)
    results["written"] = [write(vehicle, *written), read(vehicle, written[0])]
    results["refused"] = [write(vehicle, *refused), read(vehicle, refused[0])]
    results["unknown"] = write(vehicle, "cascade.k9", 1.0)
    results["subscribed"] = vehicle.obey(bytes([SUBSCRIBE]) + vehicle.names["varint"](1))
    results["ticks"] = [vehicle.ask(TELEMETRY)["mode"] for _ in range(10)]
    arm = vehicle.names["ARM"]
    results["armed without a state"] = vehicle.obey(arm)
    for _ in range(60):
        vehicle.say(state)
    results["armed"] = vehicle.obey(arm, state)
    results["after arming"] = vehicle.ask(TELEMETRY, state)
    results["started"] = vehicle.obey(bytes([COMMAND, COMMANDS["start"]]), state)
    results["after starting"] = vehicle.ask(TELEMETRY, state)
    results["health"] = vehicle.ask(HEALTH, state, state)
    return results


def main(protocol, link):
    names, examples = page(protocol)
    hello, arm, state, *answers = examples
    position, velocity = (98.0, -2.0, 0.0), (0.5, 0.25, -1.0)
    assert names["frame"](0, names["HELLO"]) == hello
    assert names["frame"](1, names["ARM"]) == arm
    example = names["state"](1000, position, velocity, (0, 0, 0, 1), (0, 0.125, 0))
    assert names["frame"](2, example) == state
    results = {"examples": [parse(names["unframe"](frame[:-1])[1]) for frame in answers]}
    at_rest = names["state"](0, position, (0, 0, 0), (0, 0, 1, 0), (0, 0, 0))
    if link.startswith("tcp:"):
        vehicle = SteppedVehicle(names, Wire(int(link[4:])))
    else:
        vehicle = Vehicle(names, Fifos(link))
    results |= converse(vehicle, ("cascade.k1", 0.4375), ("cascade.M1", 9.0), at_rest)
    json.dump(results, sys.stdout)


if __name__ == "__main__":
    main(*sys.argv[1:])
