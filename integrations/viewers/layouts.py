"""Writes the layouts of a flight's curves for Foxglove and Rerun: `foxglove.json` and `rerun.rbl`, beside this file.

    python3 layouts.py [DIRECTORY]

One table of plots gives both. Needs rerun-sdk 0.41. `docs/logs.md` says how to open them.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

AXES = "xyz"
APPLICATION = "gyrfalcon"

# Colours that keep their order of lightness in either theme: axes x, y, z, then the fourth.
COLOURS = ["#d1495b", "#2a9d5c", "#3a7bd5", "#b07d2b"]
# The wanted value beside the actual one.
PALE = ["#e8a3ac", "#8fd0ab", "#98bceb", "#dcc08f"]


def vector(topic, field, axes=AXES, colours=COLOURS, name=None):
    """Curves of the parts of a vector: topic, path of the field, name, colour."""
    return [(topic, f"{field}.{axis}", f"{name or field} {axis}", colour)
            for axis, colour in zip(axes, colours)]


def scalar(topic, field, name=None, colour=COLOURS[0]):
    """One curve."""
    return [(topic, field, name or field.replace("_", " "), colour)]


# Title with unit, curves.
PLOTS = [
    ("position [m]", vector("reference", "position", colours=PALE, name="reference") + vector("state", "position")),
    ("velocity [m/s]", vector("reference", "velocity", colours=PALE, name="reference") + vector("state", "velocity")),
    ("position error [m]", vector("errors", "position")),
    ("attitude error q_e", vector("errors", "attitude", axes="wxyz", colours=COLOURS[3:] + COLOURS, name="q_e")),
    ("rate [rad/s]", vector("state", "rate") + vector("errors", "rate", colours=PALE, name="error")),
    ("thrust [N]", scalar("wrench", "thrust") + scalar("wrench", "applied_thrust", colour=PALE[0])),
    ("torque [N m]", vector("wrench", "torque_demand", colours=PALE, name="demand") + vector("wrench", "torque")),
    ("mass estimate [kg]", scalar("estimates", "mass")),
    ("inertia estimate [kg m^2]", vector("estimates", "inertia")),
    ("disturbance [m/s^2]", vector("disturbance", "acceleration")
     + vector("estimates", "lasting_acceleration", colours=PALE, name="estimate")),
    ("auxiliary system, q_a", vector("auxiliary", "attitude", axes="wxyz", colours=COLOURS[3:] + COLOURS, name="q_a")),
    ("Lyapunov function V", scalar("lyapunov", "value") + scalar("lyapunov", "parameter_part", colour=COLOURS[2])),
]


def schema(topic):
    """Name of a topic's message."""
    return "gyrfalcon." + "".join(word.capitalize() for word in topic.split("_"))


def colour_of(text):
    """Red, green and blue of `#rrggbb`."""
    return [int(text[at:at + 2], 16) for at in (1, 3, 5)]


def foxglove():
    """A layout: 3-D and notes at the left, curves in two columns."""
    def plot(title, curves):
        return {
            "title": title,
            "paths": [{"value": f"/gyrfalcon/{topic}.{field}", "label": name, "color": colour, "enabled": True,
                       "timestampMethod": "receiveTime"} for topic, field, name, colour in curves],
            "xAxisVal": "timestamp", "isSynced": True, "showLegend": True, "legendDisplay": "floating",
            "showXAxisLabels": True, "showYAxisLabels": True, "showPlotValuesInLegend": False, "sidebarDimension": 240,
        }

    def column(names):
        """A stack of panels of the same height."""
        first, *rest = names
        if not rest:
            return first
        share = 100 / len(names)
        return {"direction": "column", "first": first, "second": column(rest), "splitPercentage": share}

    def row(first, second, share):
        return {"direction": "row", "first": first, "second": second, "splitPercentage": share}

    plots = {f"Plot!{number:02}": plot(*it) for number, it in enumerate(PLOTS)}
    topics = {topic: {"visible": True} for topic in ("/vehicle/pose", "/reference/pose", "/reference/path")}
    panels = {
        "3D!vehicle": {"followTf": "vehicle", "followMode": "follow-position", "topics": topics,
                       "cameraState": {"distance": 6, "perspective": True, "phi": 65, "thetaOffset": 45, "fovy": 45,
                                       "near": 0.1, "far": 1000, "target": [0, 0, 0], "targetOffset": [0, 0, 0]},
                       "transforms": {"frame:vehicle": {"visible": True}, "frame:world": {"visible": True}},
                       "layers": {"grid": {"layerId": "foxglove.Grid", "instanceId": "grid", "label": "Grid",
                                           "visible": True, "frameLocked": True, "size": 20, "divisions": 20}}},
        "Log!notes": {"searchTerms": [], "minLogLevel": 1, "topicToRender": "/log"},
    }
    names, half = list(plots), len(plots) // 2
    curves = row(column(names[:half]), column(names[half:]), 50)
    return {
        "configById": {**panels, **plots}, "globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1},
        "layout": row({"direction": "column", "first": "3D!vehicle", "second": "Log!notes", "splitPercentage": 70},
                      curves, 34),
    }


def rerun():
    """A blueprint with the same panels."""
    def line(topic, field, name, colour):
        mapping = VisualizerComponentMapping(
            target="Scalars:scalars", source_kind=ComponentSourceKind.SourceComponent,
            source_component=f"{schema(topic)}:message", selector=f".{field}")
        return rr.SeriesLines(names=name, colors=colour_of(colour)).visualizer(mappings=[mapping])

    def point(colour, radius):
        """A point at every pose of an entity, which has no shape of its own."""
        return rr.Points3D([[0, 0, 0]], colors=colour_of(colour), radii=radius)

    def plot(title, curves):
        overrides = {}
        for topic, *curve in curves:
            overrides.setdefault(f"/gyrfalcon/{topic}", []).append(line(topic, *curve))
        return rrb.TimeSeriesView(origin="/", name=title, contents=list(overrides), overrides=overrides)

    left = rrb.Vertical(
        rrb.Spatial3DView(
            origin="/", name="vehicle and reference", contents=["/vehicle/**", "/reference/**", "/tf"],
            spatial_information=rrb.SpatialInformation(target_frame="world"),
            overrides={
                "/vehicle/pose": point(COLOURS[0], 0.15),
                "/reference/pose": point(COLOURS[2], 0.1),
                "/reference/path": point(PALE[2], 0.02),
            }),
        rrb.TextLogView(origin="/log", name="notes"),
        row_shares=[7, 3],
    )
    plots = rrb.Grid(*(plot(*it) for it in PLOTS), grid_columns=2)
    return rrb.Blueprint(rrb.Horizontal(left, plots, column_shares=[1, 2]), collapse_panels=True)


def main():
    directory = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    text = json.dumps(foxglove(), indent=1) + "\n"
    (directory / "foxglove.json").write_text(text, encoding="utf-8")
    rerun().save(APPLICATION, directory / "rerun.rbl")


if __name__ == "__main__":
    main()
