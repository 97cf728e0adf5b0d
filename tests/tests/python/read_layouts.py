"""Holds the layouts for Foxglove and Rerun against a real log: every curve is of a field that the log has.

    python3 read_layouts.py flight.mcap flight.rrd DIRECTORY

flight.rrd: the MCAP as `rerun mcap convert` made it. DIRECTORY: what `layouts.py` wrote. Prints counts as JSON.
"""

import json
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from rerun.chunk import RrdReader

MAPPING = "VisualizerInstruction:component_map"


def messages(path):
    """One message of each topic."""
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return {channel.topic: message for _, channel, _, message in reader.iter_decoded_messages()}


def panels(layout):
    """Names of the panels that a layout shows."""
    if isinstance(layout, str):
        return [layout]
    return panels(layout["first"]) + panels(layout["second"])


def check_foxglove(layout, log):
    """Number of curves; each is a number of a message in the log."""
    config = layout["configById"]
    assert sorted(panels(layout["layout"])) == sorted(config), "every panel is shown once"
    curves = 0
    for name, panel in config.items():
        for topic in panel.get("topics", [panel["topicToRender"]] if "topicToRender" in panel else []):
            assert topic in log, f"{name}: no {topic}"
        for path in panel.get("paths", []):
            topic, *fields = path["value"].split(".")
            value = log[topic]
            for field in fields:
                value = getattr(value, field)
            assert isinstance(value, (int, float)), path["value"]
            curves += 1
    return curves


def components(path):
    """Type of each component of each entity of a recording."""
    found = {}
    for chunk in RrdReader(path).stream():
        for field in chunk.to_record_batch().schema:
            found[str(chunk.entity_path), field.name] = field.type
    return found


def check_rerun(path, recorded):
    """Number of curves; each is a number of a component in the recording."""
    reader = RrdReader(path)
    (blueprint,) = reader.blueprints()
    assert blueprint.application_id == "gyrfalcon", blueprint
    curves = 0
    for chunk in reader.stream(store=blueprint):
        batch = chunk.to_record_batch()
        if MAPPING not in batch.schema.names:
            continue
        entity = str(chunk.entity_path).split("/overrides")[1].split("/visualizers/")[0]
        for mapping in (it for row in batch.column(MAPPING).to_pylist() for it in row):
            kind = recorded[entity, mapping["source_component"]].value_type
            for field in mapping["selector"].removeprefix(".").split("."):
                kind = kind.field(field).type
            assert str(kind) in ("float", "double"), mapping
            curves += 1
    return curves


def main():
    flight, recording, directory = sys.argv[1], sys.argv[2], Path(sys.argv[3])
    layout = json.loads((directory / "foxglove.json").read_text())
    print(json.dumps({
        "foxglove": check_foxglove(layout, messages(flight)),
        "rerun": check_rerun(str(directory / "rerun.rbl"), components(recording)),
    }))


main()
