//! Contents of a file, read back by the library that wrote it; `sil-host/tests/log_readers.rs` tries other
//! readers.

use std::io::Cursor;

use ::mcap::{MessageStream, Summary};
use glam::{DQuat, DVec3};
use prost::Message as _;
use prost_types::FileDescriptorSet;

use super::*;
use crate::log::moment::{LoggedStatus, MOTORS};
use sim::guarantee::lyapunov::Evaluator;
use sim::guarantee::test_flight::{VEHICLE as BODY, both, sample};
use sim::scenario::LoadedScenario;
use sim::tick::Tick;

fn description() -> Description {
    let changes = ["duration=3".to_owned()];
    Description::new(&LoadedScenario::open("paper-saturated", &changes).unwrap()).unwrap()
}

/// A file with these samples and a note.
fn file(samples: &[Tick]) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let description = description();
    let mut writer = Box::new(McapWriter::new(&mut bytes, &description).unwrap());
    let [_, law] = both(1e-3);
    for tick in samples {
        let tick = Evaluator::new(&law, &BODY).evaluated(tick);
        let moment = Moment {
            tick,
            bounds: description.bounds,
            motors: [f32::NAN; MOTORS],
            status: LoggedStatus::ON_TRAJECTORY,
        };
        writer.moment(&moment).unwrap();
    }
    let note = Note { time: 1.5, level: Level::Warning, text: "sign flipped".to_owned() };
    writer.note(&note).unwrap();
    writer.finish().unwrap();
    bytes.into_inner()
}

fn turned() -> Tick {
    let mut tick = sample(&both(1e-3)[1]);
    tick.time = 1.25;
    tick.truth.position_world = DVec3::new(1.0, -2.0, 3.0);
    tick.truth.attitude = DQuat::from_xyzw(0.5, -0.5, 0.1, 0.7).normalize();
    tick.output.wrench.thrust = 6.5;
    tick
}

/// Time [ns] and bytes of the latest message of a topic.
fn latest(file: &[u8], topic: &str) -> (u64, Vec<u8>) {
    let messages = MessageStream::new(file).unwrap().map(Result::unwrap);
    let last = messages.filter(|message| message.channel.topic == topic).last();
    let last = last.unwrap_or_else(|| panic!("no {topic}"));
    assert_eq!(last.log_time, last.publish_time);
    (last.log_time, last.data.to_vec())
}

#[test]
fn the_pose_is_the_truth_in_our_own_axes() {
    let tick = turned();
    let file = file(&[tick]);
    let (time, bytes) = latest(&file, "/vehicle/pose");
    let read = PoseInFrame::decode(&*bytes).unwrap();
    assert_eq!(time, 1_250_000_000);
    assert_eq!(read.timestamp, Some(Timestamp { seconds: 1, nanos: 250_000_000 }));
    assert_eq!(read.frame_id, "world");
    let (position, attitude) = (tick.truth.position_world, tick.truth.attitude);
    assert_eq!(read.pose, Some(Pose::new(position, attitude)));
    let read = FrameTransform::decode(&*latest(&file, "/tf").1).unwrap();
    assert_eq!((read.parent_frame_id, read.child_frame_id), ("world".into(), "vehicle".into()));
    assert_eq!((read.translation, read.rotation), (Some(position.into()), Some(attitude.into())));
}

#[test]
fn the_reference_has_its_thrust_and_heading_as_axes() {
    let tick = turned();
    let (_, bytes) = latest(&file(&[tick]), "/reference/pose");
    let pose = PoseInFrame::decode(&*bytes).unwrap().pose.unwrap();
    let foxglove::Quaternion { x, y, z, w } = pose.orientation.unwrap();
    let attitude = DQuat::from_xyzw(x, y, z, w);
    let up = tick.reference.specific_force().value.as_dvec3().normalize();
    assert!((attitude * DVec3::Z - up).length() < 1e-6);
    assert!((attitude * DVec3::Y - tick.reference.left_world.as_dvec3()).length() < 1e-6);
}

#[test]
fn our_topics_have_the_table_s_fields_by_number() {
    #[derive(Clone, PartialEq, prost::Message)]
    struct Wrench {
        #[prost(message, optional, tag = "1")]
        timestamp: Option<Timestamp>,
        #[prost(float, tag = "2")]
        thrust: f32,
        #[prost(message, optional, tag = "3")]
        torque_demand: Option<own::Vector3>,
        #[prost(message, optional, tag = "4")]
        torque: Option<own::Vector3>,
    }
    let tick = turned();
    let read = Wrench::decode(&*latest(&file(&[tick]), "/gyrfalcon/wrench").1).unwrap();
    let torque = tick.output.wrench.torque_body;
    let vector = own::Vector3 { x: torque.x, y: torque.y, z: torque.z };
    assert_eq!((read.thrust, read.torque), (6.5, Some(vector)));
    assert_eq!(read.timestamp, Some(Timestamp { seconds: 1, nanos: 250_000_000 }));
    assert!(read.torque_demand.is_some());
}

#[test]
fn every_schema_brings_all_that_it_imports() {
    let file = file(&[]);
    let summary = Summary::read(&file).unwrap().unwrap();
    assert_eq!(summary.channels.len(), 5 + TOPICS.len());
    for channel in summary.channels.values() {
        let schema = channel.schema.as_ref().unwrap();
        assert_eq!((&*schema.encoding, &*channel.message_encoding), (PROTOBUF, PROTOBUF));
        let set = FileDescriptorSet::decode(&*schema.data).unwrap();
        let mut known = Vec::new();
        for file in &set.file {
            assert!(file.dependency.iter().all(|path| known.contains(path)), "{}", schema.name);
            known.push(file.name().to_owned());
        }
        let last = set.file.last().unwrap();
        assert_eq!(format!("{}.{}", last.package(), last.message_type[0].name()), schema.name);
    }
}

#[test]
fn notes_are_foxglove_s_log_messages() {
    let read = Log::decode(&*latest(&file(&[]), "/log").1).unwrap();
    assert_eq!(foxglove::LEVELS[read.level as usize], "WARNING");
    assert_eq!((&*read.message, &*read.name), ("sign flipped", "gyrfalcon"));
}

#[test]
fn the_path_ahead_is_there_from_the_start() {
    let (time, bytes) = latest(&file(&[]), "/reference/path");
    let path = PosesInFrame::decode(&*bytes).unwrap();
    assert_eq!((time, path.poses.len()), (0, 1000));
    let start = path.poses[0].position.unwrap();
    assert_eq!((start.x, start.y, start.z), (100.0, 0.0, 0.0));
}

#[test]
fn metadata_and_the_scenario_are_found_by_the_summary() {
    let file = file(&[]);
    let summary = Summary::read(&file).unwrap().unwrap();
    let names: Vec<_> = summary.metadata_indexes.iter().map(|index| &*index.name).collect();
    assert_eq!(names, ["flight", "parameters"]);
    let metadata = ::mcap::read::metadata(&file, &summary.metadata_indexes[0]).unwrap();
    assert_eq!(metadata.metadata["scenario"], "paper-saturated");
    assert_eq!((&*metadata.metadata["seed"], &*metadata.metadata["version"]), ("1", VERSION));
    let attachment = ::mcap::read::attachment(&file, &summary.attachment_indexes[0]).unwrap();
    assert_eq!(attachment.name, "paper-saturated.toml");
    assert_eq!(attachment.data, description().toml.as_bytes());
}

#[test]
fn a_long_flight_is_cut_into_indexed_chunks() {
    let file = file(&vec![turned(); 2000]);
    let summary = Summary::read(&file).unwrap().unwrap();
    assert!(summary.chunk_indexes.len() > 1);
    let count = summary.stats.unwrap().message_count;
    assert_eq!(count, 2000 * (3 + TOPICS.len() as u64) + 2);
    // Messages of about 50 bytes, with time, channel, sequence and an entry of an index.
    assert!(file.len() as u64 / count < 110, "{} bytes for {count} messages", file.len());
}

#[test]
fn an_error_of_the_file_is_returned() {
    #[derive(Debug)]
    struct Full;
    impl Write for Full {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(io::ErrorKind::StorageFull.into())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    impl Seek for Full {
        fn seek(&mut self, _: io::SeekFrom) -> io::Result<u64> {
            Ok(0)
        }
    }
    let error = McapWriter::new(Full, &description()).unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::StorageFull);
}
