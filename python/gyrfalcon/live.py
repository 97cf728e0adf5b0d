"""Flights in a viewer while they are flown: Rerun (`rerun-sdk`) or Foxglove (`foxglove-sdk`).

A viewer is what `gyrfalcon.run` takes as `watch`:

    >>> with live.Rerun(spawn=True) as viewer:
    ...     gyrfalcon.run("tilt-recovery", watch=viewer, watch_every=20)

Both show the vehicle and its reference in space, and over time the quantities that `plots` names. World axes are
east, north, up; nothing is converted.
"""

from __future__ import annotations

import json
import os
import time
from collections import deque
from collections.abc import Iterable
from types import TracebackType
from typing import Any, Final

import numpy as np

from ._core import Tick
from .quantity import QUANTITIES

PLOTS: Final = (
    "position_error",
    "velocity",
    "rate",
    "tilt_error",
    "thrust",
    "torque",
    "mass_estimate",
    "lyapunov",
)
"""Quantities that are plotted unless others are asked for."""

TRAIL: Final = 400
"""Places of the vehicle that its trail has."""

TRAIL_EVERY: Final = 10
"""Ticks shown between two drawings of the trail."""

ARM: Final = 0.25
"""Half the length of the vehicle that is drawn (m)."""


class _Viewer:
    """Pace and plotted quantities of every viewer."""

    def __init__(self, plots: Iterable[str], speed: float | None) -> None:
        self._plots = tuple(plots)
        unknown = [name for name in self._plots if name not in QUANTITIES]
        if unknown:
            raise ValueError(f"plots: no quantity {unknown[0]!r}; gyrfalcon.QUANTITIES lists them")
        if speed is not None and not speed > 0.0:
            raise ValueError(f"speed = {speed} must be positive")
        self._speed = speed
        self._start: float | None = None

    def __call__(self, tick: Tick) -> None:
        """Shows a tick."""
        self._wait(tick.time)
        self._show(tick)

    def close(self) -> None:
        """Ends the recording; what has been shown is complete."""
        raise NotImplementedError

    def _show(self, tick: Tick) -> None:
        raise NotImplementedError

    def _wait(self, seconds: float) -> None:
        """Sleeps until the time of a tick, at the pace asked for."""
        if self._speed is None:
            return
        now = time.monotonic()
        if self._start is None:
            self._start = now - seconds / self._speed
        time.sleep(max(0.0, self._start + seconds / self._speed - now))

    def _numbers(self, tick: Tick) -> dict[str, float]:
        """The plotted quantities by component: `torque_x`, `thrust`."""
        numbers = {}
        for name in self._plots:
            values = np.atleast_1d(tick[name])
            for end, value in zip(QUANTITIES[name].suffixes, values, strict=True):
                numbers[name + end] = float(value)
        return numbers

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class Rerun(_Viewer):
    """A flight in Rerun's viewer; needs `rerun-sdk`.

    Args:
        save: file of the recording, `*.rrd`.
        spawn: starts the viewer, and shows the flight there.
        connect: address of a viewer that runs, as in `rerun+http://127.0.0.1:9876/proxy`.
        plots: names of quantities that are plotted.
        speed: 1 flies in real time, 2 twice as fast, None as fast as it can.
        name: name of the recording.

    One of `save`, `spawn` and `connect` is needed.
    """

    def __init__(
        self,
        *,
        save: str | os.PathLike[str] | None = None,
        spawn: bool = False,
        connect: str | None = None,
        plots: Iterable[str] = PLOTS,
        speed: float | None = None,
        name: str = "gyrfalcon",
    ) -> None:
        super().__init__(plots, speed)
        if (save is not None) + spawn + (connect is not None) != 1:
            raise ValueError("one of save, spawn and connect is needed")
        import rerun

        self._rerun = rerun
        self._recording = rerun.RecordingStream(name)
        if save is not None:
            self._recording.save(os.fspath(save))
        elif connect is not None:
            self._recording.connect_grpc(connect)
        else:
            self._recording.spawn()
        self._trail: deque[Any] = deque(maxlen=TRAIL)
        self._shown = 0
        self._log("world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        body = rerun.Boxes3D(half_sizes=[[ARM, ARM, 0.05]], colors=[[57, 135, 229]])
        self._log("world/vehicle/body", body, static=True)

    def __enter__(self) -> Rerun:
        return self

    def close(self) -> None:
        """Writes what is left and closes the recording."""
        self._recording.flush()
        self._recording.disconnect()

    def _log(self, path: str, what: Any, *, static: bool = False) -> None:
        self._recording.log(path, what, static=static)

    def _show(self, tick: Tick) -> None:
        rerun = self._rerun
        self._recording.set_time("time", duration=tick.time)
        position, (w, x, y, z) = tick["position"], tick["attitude"]
        turned = rerun.Quaternion(xyzw=[x, y, z, w])
        self._log("world/vehicle", rerun.Transform3D(translation=position, quaternion=turned))
        thrust = [[0.0, 0.0, 0.1 * tick["thrust"]]]
        self._log("world/vehicle/thrust", rerun.Arrows3D(vectors=thrust))
        reference = rerun.Points3D([tick["reference_position"]], radii=[0.05])
        self._log("world/reference", reference)
        self._trail.append(position)
        self._shown += 1
        if self._shown % TRAIL_EVERY == 0:
            self._log("world/trail", rerun.LineStrips3D([list(self._trail)]))
        for name, value in self._numbers(tick).items():
            self._log(f"plots/{name}", rerun.Scalars(value))


class Foxglove(_Viewer):
    """A flight in Foxglove, over a server that Foxglove's application connects to, or as an MCAP file; needs
    `foxglove-sdk`.

    Args:
        save: file of the recording, `*.mcap`.
        port: TCP port of the server, on this machine; 0 takes a free one, which `port` then names.
        plots: names of quantities that are published, on the topic `/plots`.
        speed: 1 flies in real time, 2 twice as fast, None as fast as it can.

    One of `save` and `port` is needed. Frames: `world`, `vehicle`, `reference`.
    """

    def __init__(
        self,
        *,
        save: str | os.PathLike[str] | None = None,
        port: int | None = None,
        plots: Iterable[str] = PLOTS,
        speed: float | None = None,
    ) -> None:
        super().__init__(plots, speed)
        if (save is None) == (port is None):
            raise ValueError("one of save and port is needed")
        import foxglove
        from foxglove import channels, messages

        self._messages: Any = messages
        # A context of its own: two viewers at once do not see each other's topics.
        self._context = context = foxglove.Context()
        self._sink: Any
        if save is not None:
            self._sink = foxglove.open_mcap(os.fspath(save), allow_overwrite=True, context=context)
        else:
            self._sink = foxglove.start_server(name="gyrfalcon", port=port, context=context)
        self.port: int | None = None if save is not None else int(self._sink.port)
        self._frames = channels.FrameTransformsChannel("/tf", context=context)
        self._scene = channels.SceneUpdateChannel("/scene", context=context)
        schema = _schema(name + end for name in self._plots for end in QUANTITIES[name].suffixes)
        self._numbers_channel = foxglove.Channel(
            "/plots", schema=schema, message_encoding="json", context=context
        )
        self._drawn = False

    def __enter__(self) -> Foxglove:
        return self

    def close(self) -> None:
        """Writes what is left and closes the file or the server."""
        if self.port is None:
            self._sink.close()
        else:
            self._sink.stop()

    def _show(self, tick: Tick) -> None:
        nanoseconds = round(tick.time * 1e9)
        messages = self._messages
        stamp = messages.Timestamp(nanoseconds // 10**9, nanoseconds % 10**9)
        frames = [
            self._frame(stamp, "vehicle", tick["position"], tick["attitude"]),
            self._frame(stamp, "reference", tick["reference_position"], (1.0, 0.0, 0.0, 0.0)),
        ]
        transforms = messages.FrameTransforms(transforms=frames)
        self._frames.log(transforms, log_time=nanoseconds)
        if not self._drawn:
            self._scene.log(self._vehicle(stamp), log_time=nanoseconds)
            self._drawn = True
        numbers = {"time": tick.time, **self._numbers(tick)}
        self._numbers_channel.log(json.dumps(numbers).encode(), log_time=nanoseconds)

    def _frame(self, stamp: Any, name: str, position: Any, attitude: Any) -> Any:
        messages, (w, x, y, z) = self._messages, attitude
        px, py, pz = position
        return messages.FrameTransform(
            timestamp=stamp,
            parent_frame_id="world",
            child_frame_id=name,
            translation=messages.Vector3(x=float(px), y=float(py), z=float(pz)),
            rotation=messages.Quaternion(x=float(x), y=float(y), z=float(z), w=float(w)),
        )

    def _vehicle(self, stamp: Any) -> Any:
        """The vehicle as a box, and its reference as a ball."""
        messages = self._messages
        still = messages.Pose(
            position=messages.Vector3(x=0.0, y=0.0, z=0.0),
            orientation=messages.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
        )
        box = messages.CubePrimitive(
            pose=still,
            size=messages.Vector3(x=2 * ARM, y=2 * ARM, z=0.1),
            color=messages.Color(r=0.22, g=0.53, b=0.9, a=1.0),
        )
        ball = messages.SpherePrimitive(
            pose=still,
            size=messages.Vector3(x=0.1, y=0.1, z=0.1),
            color=messages.Color(r=0.9, g=0.5, b=0.1, a=1.0),
        )
        entity = messages.SceneEntity
        entities = [
            entity(timestamp=stamp, frame_id="vehicle", id="vehicle", cubes=[box]),
            entity(timestamp=stamp, frame_id="reference", id="reference", spheres=[ball]),
        ]
        return messages.SceneUpdate(entities=entities)


def _schema(names: Iterable[str]) -> dict[str, Any]:
    """JSON schema of a message of numbers."""
    properties = {name: {"type": "number"} for name in ("time", *names)}
    return {"type": "object", "properties": properties}
