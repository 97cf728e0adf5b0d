"""Types commands into MAVProxy, connected to a vehicle, and prints what it said, as JSON.

Arguments: MAVProxy's program, its connection.
"""

import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time

program, master = sys.argv[1:3]
state = tempfile.mkdtemp()
proxy = subprocess.Popen(
    [sys.executable, "-u", program, f"--master={master}", f"--state-basedir={state}", "--mav20",
     "--default-modules=misc,param,arm,mode,cmdlong,wp,signing"],
    stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=state,
    env={**os.environ, "HOME": state})
lines, said = queue.Queue(), []
threading.Thread(target=lambda: [lines.put(line.rstrip()) for line in proxy.stdout], daemon=True).start()


def expect(text, seconds):
    """Waits for a line with `text`."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            said.append(lines.get(timeout=0.1))
        except queue.Empty:
            continue
        if text in said[-1]:
            return time.monotonic() - (end - seconds)
    proxy.kill()
    raise SystemExit(f"no {text!r} in {seconds} s:\n" + "\n".join(said))


def type_in(line):
    proxy.stdin.write(line + "\n")
    proxy.stdin.flush()


times = {"parameters": expect("Received", 30)}
type_in("param show CTL_K1")
expect("CTL_K1", 5)
type_in("param set MIS_TAKEOFF_ALT 2")
time.sleep(0.5)
type_in("param show MIS_TAKEOFF_ALT")
expect("MIS_TAKEOFF_ALT", 5)
type_in("arm throttle")
expect("armed", 10)
type_in("long MAV_CMD_NAV_TAKEOFF 0 0 0 nan nan nan nan")
expect("take-off done", 60)
type_in("long MAV_CMD_NAV_LAND 0 0 0 nan 0 0 nan")
expect("landed", 60)
proxy.kill()
print(json.dumps({"said": said, "times": times}))
