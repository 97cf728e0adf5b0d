"""Reads an MCAP with `mcap` and holds it against the trace of the same flight and Foxglove's schemas.

    python3 read_mcap.py flight.mcap trace.csv EVERY

EVERY: rows of the trace from one instant of the log to the next. Prints what is left to check as JSON.
"""

import importlib
import json
import sys
from collections import defaultdict

import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from flight_trace import Trace, rising, same

TYPES = {"float": np.float32, "double": np.float64, "count": np.int64}
KINDS = {1: "double", 2: "float", 4: "count", 13: "count"}  # numbers of protobuf's types


def array(messages, field):
    """A field of every message, a row an instant, in the type of the schema."""
    described = messages[0].DESCRIPTOR.fields_by_name[field]
    values = [getattr(message, field) for message in messages]
    if described.message_type is None:
        return np.array(values, dtype=TYPES[KINDS[described.type]])[:, np.newaxis]
    axes = [axis.name for axis in described.message_type.fields]
    kind = TYPES[KINDS[described.message_type.fields[0].type]]
    return np.array([[getattr(value, axis) for axis in axes] for value in values], dtype=kind)


def check_poses(topics, trace):
    """Foxglove's messages say what ours say."""
    poses = [message.pose for message in topics["/vehicle/pose"]]
    transforms = topics["/tf"]
    wanted = trace.array("position", 3).astype(np.float32)
    turned = trace.array("attitude", 4).astype(np.float32)
    scalar_first = [3, 0, 1, 2]
    for what, place, turn in [
        ("/vehicle/pose", array(poses, "position"), array(poses, "orientation")),
        ("/tf", array(transforms, "translation"), array(transforms, "rotation")),
    ]:
        same(what, place.astype(np.float32), wanted)
        same(what, turn[:, scalar_first].astype(np.float32), turned)
    poses = [message.pose for message in topics["/reference/pose"]]
    wanted = trace.array("reference_position", 3).astype(np.float32)
    same("/reference/pose", array(poses, "position").astype(np.float32), wanted)


def check_schema(schema):
    """What a schema says of Foxglove's messages is what Foxglove says."""
    for file in FileDescriptorSet.FromString(schema.data).file:
        if not file.name.startswith("foxglove/"):
            continue
        module = file.name.removesuffix(".proto").removeprefix("foxglove/")
        official = FileDescriptorProto()
        module = importlib.import_module(f"foxglove_schemas_protobuf.{module}_pb2")
        module.DESCRIPTOR.CopyToProto(official)
        assert sorted(file.dependency) == sorted(official.dependency), file.name
        assert file.message_type == official.message_type, file.name
        assert (file.package, file.syntax) == (official.package, official.syntax), file.name


def check_channel(channel, message):
    """Our own topics have a unit and a meaning for every field."""
    if channel.topic.startswith("/gyrfalcon/"):
        names = [field.name for field in message.DESCRIPTOR.fields if field.name != "timestamp"]
        keys = {f"{kind}.{name}" for kind in ("unit", "what") for name in names}
        assert set(channel.metadata) == keys, f"{channel.topic}: {channel.metadata}"


def main():
    path, trace, every = sys.argv[1], sys.argv[2], int(sys.argv[3])
    trace = Trace(trace, every)
    topics, times = defaultdict(list), defaultdict(list)
    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        for _, channel, message, decoded in reader.iter_decoded_messages():
            topics[channel.topic].append(decoded)
            times[channel.topic].append(message.log_time)
            assert message.publish_time == message.log_time, channel.topic
            assert decoded.timestamp.ToNanoseconds() == message.log_time, channel.topic
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = [[it.name, it.media_type, it.data.decode()] for it in reader.iter_attachments()]
    for channel in summary.channels.values():
        check_channel(channel, topics[channel.topic][0])
        if channel.topic not in ("/log", "/reference/path"):
            rising(channel.topic, times[channel.topic])
            micros = np.rint(np.array(times[channel.topic]) / 1e3).astype(np.int64)
            same(f"{channel.topic}, time", micros, trace.micros())
    for schema in summary.schemas.values():
        check_schema(schema)
    trace.check(lambda topic, field: array(topics[f"/gyrfalcon/{topic}"], field))
    check_poses(topics, trace)
    levels = topics["/log"][0].DESCRIPTOR.enum_types_by_name["Level"].values_by_number
    print(json.dumps({
        "instants": len(trace),
        "topics": sorted(topics),
        "chunks": summary.statistics.chunk_count,
        "path": len(topics["/reference/path"][0].poses),
        "metadata": metadata,
        "attachments": attachments,
        "notes": [[levels[note.level].name, note.timestamp.ToMicroseconds(), note.message]
                  for note in topics["/log"]],
    }))


main()
