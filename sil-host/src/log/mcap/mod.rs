//! MCAP with protobuf messages: our topics beside Foxglove's well-known ones.
//!
//! Protobuf, because it is the one encoding that Foxglove, Rerun and PlotJuggler all read (Rerun turns
//! Foxglove's messages into 3-D entities in protobuf only). Chunked with indexes and a summary, not
//! compressed: the libraries for that would double the time to build.

mod foxglove;
mod own;
mod schema;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Seek, Write};

use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::{Attachment, McapError, WriteOptions};
use prost_types::Timestamp;

use super::description::{Description, VERSION};
use super::moment::{Moment, nanoseconds, reference_attitude};
use super::note::{Level, Note};
use super::{PREFIX, Writer};
use sim::quantity::{TOPICS, Topic};

use foxglove::{FrameTransform, Log, Pose, PoseInFrame, PosesInFrame};
use schema::File;

/// The fixed frame: x east, y north, z up.
const WORLD: &str = "world";
/// The frame of the vehicle: x forward, y left, z up.
const VEHICLE: &str = "vehicle";
/// Encoding of every schema and message.
const PROTOBUF: &str = "protobuf";

/// Writes a flight as MCAP.
pub struct McapWriter<W: Write + Seek> {
    file: ::mcap::Writer<W>,
    own: Vec<u16>,
    pose: u16,
    transform: u16,
    reference: u16,
    notes: u16,
    /// Messages written to each channel, by its number.
    sequence: BTreeMap<u16, u32>,
    buffer: Vec<u8>,
}

impl<W: Write + Seek> McapWriter<W> {
    /// Writes everything before the first message; `out` should be buffered.
    ///
    /// # Errors
    /// When `out` fails.
    pub fn new(out: W, description: &Description) -> io::Result<Self> {
        let options = WriteOptions::new().compression(None);
        let mut file = options.create(out).map_err(failed)?;
        describe(&mut file, description).map_err(failed)?;
        let mut known = |topic, schema| known(&mut file, topic, schema).map_err(failed);
        let pose = known("/vehicle/pose", &foxglove::POSE_IN_FRAME)?;
        let transform = known("/tf", &foxglove::FRAME_TRANSFORM)?;
        let reference = known("/reference/pose", &foxglove::POSE_IN_FRAME)?;
        let path = known("/reference/path", &foxglove::POSES_IN_FRAME)?;
        let notes = known("/log", &foxglove::LOG)?;
        let own = own_channels(&mut file).map_err(failed)?;
        let (sequence, buffer) = (BTreeMap::new(), Vec::new());
        let mut writer = Self { file, own, pose, transform, reference, notes, sequence, buffer };
        writer.path(path, description)?;
        Ok(writer)
    }

    /// Writes the whole reference path, once, at the start.
    fn path(&mut self, channel: u16, description: &Description) -> io::Result<()> {
        let poses = description.path.iter();
        let poses = poses.map(|it| Pose::new(it.position_world.as_dvec3(), reference_attitude(it)));
        let path = PosesInFrame {
            timestamp: Some(timestamp(0)),
            frame_id: WORLD.to_owned(),
            poses: poses.collect(),
        };
        self.message(channel, 0, &path)
    }

    fn message(
        &mut self,
        channel: u16,
        time: u64,
        message: &impl prost::Message,
    ) -> io::Result<()> {
        self.buffer.clear();
        message.encode(&mut self.buffer)?;
        self.write_out(channel, time)
    }

    fn write_out(&mut self, channel_id: u16, time: u64) -> io::Result<()> {
        let count = self.sequence.entry(channel_id).or_default();
        let header =
            MessageHeader { channel_id, sequence: *count, log_time: time, publish_time: time };
        *count = count.wrapping_add(1);
        self.file.write_to_known_channel(&header, &self.buffer).map_err(failed)
    }

    fn pose(&mut self, channel: u16, time: u64, pose: Pose) -> io::Result<()> {
        let (timestamp, frame_id) = (Some(timestamp(time)), WORLD.to_owned());
        self.message(channel, time, &PoseInFrame { timestamp, frame_id, pose: Some(pose) })
    }
}

impl<W: Write + Seek> Writer for McapWriter<W> {
    fn moment(&mut self, moment: &Moment) -> io::Result<()> {
        let time = nanoseconds(moment.tick.time);
        let stamp = timestamp(time);
        let (truth, reference) = (&moment.tick.truth, &moment.tick.reference);
        let pose = Pose::new(truth.position_world, truth.attitude);
        self.pose(self.pose, time, pose)?;
        let transform = FrameTransform {
            timestamp: Some(stamp),
            parent_frame_id: WORLD.to_owned(),
            child_frame_id: VEHICLE.to_owned(),
            translation: pose.position,
            rotation: pose.orientation,
        };
        self.message(self.transform, time, &transform)?;
        let wanted = Pose::new(reference.position_world.as_dvec3(), reference_attitude(reference));
        self.pose(self.reference, time, wanted)?;
        for (index, topic) in TOPICS.iter().enumerate() {
            self.buffer.clear();
            own::encode(&mut self.buffer, topic, &stamp, &moment.tick);
            self.write_out(self.own[index], time)?;
        }
        Ok(())
    }

    fn note(&mut self, note: &Note) -> io::Result<()> {
        let time = nanoseconds(note.time);
        let level = match note.level {
            Level::Info => foxglove::INFO,
            Level::Warning => foxglove::WARNING,
            Level::Error => foxglove::ERROR,
        };
        let log = Log {
            timestamp: Some(timestamp(time)),
            level,
            message: note.text.clone(),
            name: PREFIX.to_owned(),
        };
        self.message(self.notes, time, &log)
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.file.finish().map_err(failed)?;
        self.file.into_inner().flush()
    }
}

impl<W: Write + Seek> fmt::Debug for McapWriter<W> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("McapWriter").field("sequence", &self.sequence).finish_non_exhaustive()
    }
}

/// Writes the facts known before the flight as metadata, and the scenario as an attachment.
fn describe<W: Write + Seek>(
    file: &mut ::mcap::Writer<W>,
    description: &Description,
) -> Result<(), McapError> {
    let facts = [
        ("scenario", description.scenario.clone()),
        ("description", description.description.clone()),
        ("controller", description.controller.to_owned()),
        ("seed", description.seed.to_string()),
        ("version", VERSION.to_owned()),
    ];
    let parameters =
        description.parameters.iter().map(|(name, value)| (name.clone(), value.to_string()));
    let map = |facts: BTreeMap<String, String>, name: &str| Metadata {
        name: name.to_owned(),
        metadata: facts,
    };
    let facts = facts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    file.write_metadata(&map(facts, "flight"))?;
    file.write_metadata(&map(parameters.collect(), "parameters"))?;
    file.attach(&Attachment {
        log_time: 0,
        create_time: 0,
        name: format!("{}.toml", description.scenario),
        media_type: "application/toml".to_owned(),
        data: Cow::Borrowed(description.toml.as_bytes()),
    })
}

/// A channel for a well-known message.
fn known<W: Write + Seek>(
    file: &mut ::mcap::Writer<W>,
    topic: &str,
    schema: &File<'_>,
) -> Result<u16, McapError> {
    let id = file.add_schema(&schema.full_name(), PROTOBUF, &schema.schema())?;
    file.add_channel(id, topic, PROTOBUF, &BTreeMap::new())
}

/// Channels for our own topics, in their order; units and meaning are metadata, by field.
fn own_channels<W: Write + Seek>(file: &mut ::mcap::Writer<W>) -> Result<Vec<u16>, McapError> {
    let channel = |topic: &Topic| {
        let (name, schema) = own::schema(topic);
        let id = file.add_schema(&name, PROTOBUF, &schema)?;
        let fields = topic.quantities.iter().flat_map(|quantity| {
            let key = |kind| format!("{kind}.{}", quantity.field);
            [(key("unit"), quantity.unit.to_owned()), (key("what"), quantity.meaning.to_owned())]
        });
        file.add_channel(id, &format!("/{PREFIX}/{}", topic.name), PROTOBUF, &fields.collect())
    };
    TOPICS.iter().map(channel).collect()
}

fn timestamp(nanoseconds: u64) -> Timestamp {
    const SECOND: u64 = 1_000_000_000;
    Timestamp { seconds: (nanoseconds / SECOND) as i64, nanos: (nanoseconds % SECOND) as i32 }
}

fn failed(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
