//! The bytes of a file, against the format's description.

use std::io;

use ctrl_core::vehicle::WrenchBounds;
use glam::{DQuat, DVec3, Vec3};

use super::*;
use crate::log::moment::LoggedStatus;
use ctrl_core::controller::ControllerConfig;
use ctrl_core::mode::navigation::NavigationMode;
use sim::evaluation::Evaluation;
use sim::guarantee::lyapunov::Evaluator;
use sim::guarantee::test_flight::{VEHICLE, both, sample};
use sim::tick::Tick;

const BOUNDS: WrenchBounds =
    WrenchBounds { thrust_min: 1.0, thrust_max: 12.0, torque_max: Vec3::new(0.05, 0.05, 0.02) };

fn description() -> Description {
    Description {
        scenario: "a".to_owned(),
        description: "bc".to_owned(),
        controller: "saturated",
        seed: 0x0102_0304_0506_0708,
        toml: "é".repeat(PART),
        parameters: vec![("k4".to_owned(), 0.5)],
        step_period: 1e-3,
        bounds: BOUNDS,
        geometry: None,
        battery: false,
        path: Vec::new(),
    }
}

/// Kind and body of every message after the header.
fn messages(file: &[u8]) -> Vec<(u8, &[u8])> {
    let (mut rest, mut messages) = (&file[16..], Vec::new());
    while let [low, high, kind, after @ ..] = rest {
        let (body, after) = after.split_at(usize::from(u16::from_le_bytes([*low, *high])));
        messages.push((*kind, body));
        rest = after;
    }
    messages
}

fn written(write: impl FnOnce(&mut UlogWriter<&mut Vec<u8>>)) -> Vec<u8> {
    let mut file = Vec::new();
    write(&mut UlogWriter::new(&mut file, &description()).unwrap());
    file
}

#[test]
fn the_header_is_magic_version_and_start() {
    let file = written(|_| ());
    assert_eq!(file[..16], [0x55, 0x4c, 0x6f, 0x67, 1, 0x12, 0x35, 1, 0, 0, 0, 0, 0, 0, 0, 0]);
    // 40 bytes of flags must come first: a reader looks for them at this offset.
    assert_eq!(file[16..19], [40, 0, b'B']);
    assert_eq!(file[19..59], [0; 40]);
}

#[test]
fn definitions_come_before_subscriptions() {
    let file = written(|_| ());
    let kinds: Vec<_> = messages(&file).iter().map(|message| message.0).collect();
    let order: Vec<_> = kinds.iter().map(|kind| b"BFIMPA".iter().position(|k| k == kind)).collect();
    assert!(order.is_sorted() && order.iter().all(Option::is_some), "{order:?}");
    let count = |kind| kinds.iter().filter(|k| **k == kind).count();
    assert_eq!(count(b'F'), count(b'A'));
    assert_eq!((count(b'F'), count(b'P')), (TOPICS.len() + 11, 2));
}

#[test]
fn facts_and_formats_are_as_described() {
    let file = written(|_| ());
    let messages = messages(&file);
    let has = |kind, body: &[u8]| messages.contains(&(kind, body));
    assert!(has(b'F', b"gyrfalcon_auxiliary:uint64_t timestamp;float[4] attitude;float[3] rate;"));
    assert!(has(
        b'F',
        b"vehicle_attitude:uint64_t timestamp;uint64_t timestamp_sample;float[4] q;"
    ));
    assert!(has(
        b'F',
        b"actuator_motors:uint64_t timestamp;uint64_t timestamp_sample;float[12] control;"
    ));
    assert!(has(b'P', b"\x10int32_t MAV_TYPE\x02\0\0\0"));
    assert!(has(b'I', b"\x17uint32_t ver_sw_release\0\0\x01\0"));
    assert!(has(b'I', b"\x10char[1] scenarioa"));
    assert!(has(b'I', b"\x0duint64_t seed\x08\x07\x06\x05\x04\x03\x02\x01"));
    let units = "gyrfalcon_auxiliary: attitude [-], rate [rad/s]";
    let key = format!("char[{}] units", units.len());
    assert!(has(b'M', &[&[0, key.len() as u8], key.as_bytes(), units.as_bytes()].concat()));
}

#[test]
fn a_long_text_comes_in_parts_between_characters() {
    let file = written(|_| ());
    let parts: Vec<_> = messages(&file)
        .into_iter()
        .filter(|(_, body)| body.windows(13).any(|w| w == b"scenario_toml"))
        .collect();
    let continued: Vec<_> = parts.iter().map(|(kind, body)| (*kind, body[0])).collect();
    assert_eq!(continued, [(b'M', 0), (b'M', 1)]);
    let text = |body: &[u8]| String::from_utf8(body[2 + usize::from(body[1])..].to_vec()).unwrap();
    let text: String = parts.iter().map(|(_, body)| text(body)).collect();
    assert_eq!(text, description().toml);
}

/// A tick with round numbers: level, facing north, at (1, 2, 3).
fn north(law: &ControllerConfig) -> Tick {
    let mut tick = sample(law);
    tick.time = 1.5;
    tick.truth.position_world = DVec3::new(1.0, 2.0, 3.0);
    tick.truth.velocity_world = DVec3::new(0.5, -0.25, 4.0);
    tick.truth.attitude = DQuat::from_rotation_z(core::f64::consts::FRAC_PI_2);
    tick.output.wrench.thrust = 6.0;
    tick
}

#[test]
fn data_are_number_time_and_fields_little_endian() {
    let [_, law] = both(1e-3);
    let tick = Evaluator::new(&law, &VEHICLE).evaluated(&north(&law));
    let motors = std::array::from_fn(|i| if i < 4 { 0.25 } else { f32::NAN });
    let status = LoggedStatus { armed: true, navigation: NavigationMode::Land };
    let moment = Moment { tick, bounds: BOUNDS, motors, status };
    let file = written(|writer| writer.moment(&moment).unwrap());
    let messages = messages(&file);
    let data: Vec<_> = messages.iter().filter(|message| message.0 == b'D').collect();
    let names = messages.iter().filter(|message| message.0 == b'A').map(|message| &message.1[3..]);
    let names: Vec<_> = names.collect();
    assert_eq!(data.len(), names.len());
    let body = |name: &str| {
        let id = names.iter().position(|known| *known == name.as_bytes()).unwrap();
        assert_eq!(data[id].1[..2], (id as u16).to_le_bytes());
        data[id].1[2..].to_vec()
    };
    let time = 1_500_000_u64.to_le_bytes();
    let floats = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>();
    // y north, x east, z down; facing north is no heading.
    let values = floats(&[2.0, 1.0, -3.0, -0.25, 0.5, -4.0]);
    let bytes = body("vehicle_local_position");
    assert_eq!(bytes[..bytes.len() - 4], [&time, &time, &values[..]].concat());
    assert!(f32::from_le_bytes(*bytes.last_chunk().unwrap()).abs() < 1e-6);
    let thrust = floats(&[0.0, -0.0, -0.5]);
    assert_eq!(body("vehicle_thrust_setpoint"), [&time, &time, &thrust[..]].concat());
    let status = [&time[..], &tick.tick.to_le_bytes(), &tick.output.status.bits().to_le_bytes()];
    assert_eq!(body("gyrfalcon_status"), status.concat());
    assert_eq!(body("actuator_motors"), [&time, &time, &floats(&motors)[..]].concat());
    assert_eq!(body("vehicle_status"), [&time[..], &[2, 18, 1]].concat());
    let Evaluation { value, parameter_part, decrease, .. } = tick.evaluation;
    let values = [value, parameter_part, decrease];
    let values: Vec<_> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
    assert_eq!(body("gyrfalcon_lyapunov"), [&time, &values[..]].concat());
}

#[test]
fn a_note_is_level_time_and_text() {
    let file = written(|writer| {
        let note = Note { time: 2.0, level: Level::Error, text: "output held".to_owned() };
        writer.note(&note).unwrap();
    });
    let expected = [&b"3"[..], &2_000_000_u64.to_le_bytes(), b"output held"].concat();
    assert_eq!(messages(&file).last(), Some(&(b'L', &expected[..])));
}

#[test]
fn without_a_bound_there_is_no_torque_setpoint() {
    let names = |torque_max: f32| {
        let torque_max = Vec3::splat(torque_max);
        let bounds = WrenchBounds { torque_max, ..BOUNDS };
        px4::topics(&bounds, false).map(|topic| topic.name).collect::<Vec<_>>()
    };
    assert!(names(0.05).contains(&"vehicle_torque_setpoint"));
    assert!(!names(f32::MAX).contains(&"vehicle_torque_setpoint"));
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
    let error = UlogWriter::new(Full, &description()).unwrap_err();
    assert_eq!(error.kind(), io::ErrorKind::StorageFull);
}
