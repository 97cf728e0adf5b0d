//! Writes the seeds of the fuzz targets to `seeds/`: frames, writes and uploads of a real session.
//!
//!     cargo run --manifest-path fuzz/Cargo.toml --example seeds

use std::{fs, path::Path};

use ctrl_core::mode::Command;
use ctrl_core::reference::Reference;
use ctrl_core::trajectory::{
    CircleConfig, Heading, HoverConfig, Leg, LemniscateConfig, RisingCircleConfig,
};
use ctrl_core::vehicle::VehicleState;
use firmware::session::SessionMemory;
use firmware::tick_source::TickOrigin;
use fuzz::{GROUND, send, session, station};
use glam::Vec3;
use link::{
    ControllerKind, Downlink, Encoder, MAX_FRAME, Message, Received, TrajectorySelection, Uplink,
};

fn main() {
    let (uplink, downlink) = conversation();
    let mut stream = frames(&uplink);
    stream.extend(frames(&downlink));
    save("frame_decoder", "stream", &[&[0], &*stream.concat()].concat());
    for (i, frame) in stream.iter().enumerate() {
        save("frame_decoder", &format!("frame-{i:02}"), &[&[0], &**frame].concat());
        let content = content_of(frame);
        let framed = [&[1, content.len() as u8], &*content].concat();
        save("frame_decoder", &format!("content-{i:02}"), &framed);
    }
    for (kind, name) in [
        (ControllerKind::RobustAdaptive, "robust-adaptive"),
        (ControllerKind::Saturated, "saturated"),
    ] {
        save("parameter_writer", name, &writes(kind));
    }
    for (name, bytes) in station_sessions() {
        save("mavlink_stream", name, &bytes);
        if name == "take-off-bytes" {
            let bytes: Vec<u8> = [2].into_iter().chain(bytes.into_iter().skip(1)).collect();
            save("mavlink_stream", "take-off-unsigned", &bytes);
        }
    }
    for (name, messages) in uploads() {
        let bytes: Vec<_> = messages.iter().flat_map(|m| postcard::to_stdvec(m).unwrap()).collect();
        save("trajectory_upload", name, &bytes);
    }
}

/// Sessions of a station: frames as bytes, and records that arm, take off, stream, upload and land.
fn station_sessions() -> Vec<(&'static str, Vec<u8>)> {
    let command = |number: u16, parameters: [f32; 7]| {
        let numbers = parameters.into_iter().flat_map(f32::to_le_bytes);
        let bytes: Vec<u8> = numbers.chain(number.to_le_bytes()).chain([1, 1, 0]).collect();
        (76, bytes)
    };
    let unstated = [f32::NAN; 7];
    let first = |value| [value, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut velocity = vec![0; 53];
    velocity[16..20].copy_from_slice(&0.5_f32.to_le_bytes());
    velocity[48..53].copy_from_slice(&[0xc7, 0x0d, 1, 1, 1]);
    let mut item = vec![0; 38];
    item[24..28].copy_from_slice(&3_f32.to_le_bytes());
    item[30..35].copy_from_slice(&[22, 0, 1, 1, 3]);
    let mut parameter = vec![0; 23];
    parameter[..10].copy_from_slice(&[0, 0, 0, 63, 1, 1, b'C', b'T', b'L', b'_']);
    parameter[10..12].copy_from_slice(b"K1");
    parameter[22] = 9;
    let take_off = [command(400, first(1.0)), command(22, unstated)];
    let sessions = [
        ("take-off", [&take_off[..], &[command(21, unstated)]].concat()),
        (
            "offboard",
            [&take_off[..], &[(84, velocity), command(176, [1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0])]]
                .concat(),
        ),
        (
            "mission",
            vec![
                (44, vec![1, 0, 1, 1]),
                (73, item),
                command(400, first(1.0)),
                command(300, first(0.0)),
            ],
        ),
        ("parameters", vec![(21, vec![1, 1]), (23, parameter), (20, vec![1, 0, 1, 1])]),
        (
            "requests",
            vec![
                command(512, first(148.0)),
                command(511, [30.0, 1e4, 0.0, 0.0, 0.0, 0.0, 0.0]),
                (117, vec![0, 0, 255, 255, 1, 1]),
            ],
        ),
    ];
    sessions
        .into_iter()
        .flat_map(|(name, messages): (&'static str, Vec<(u32, Vec<u8>)>)| {
            let stream: Vec<u8> =
                messages.iter().flat_map(|(id, payload)| station::frame(*id, payload)).collect();
            let records = messages.iter().flat_map(|(id, payload)| {
                let place = station::MESSAGES.iter().position(|known| known == id).unwrap();
                [&[place as u8, 100, payload.len() as u8], &**payload].concat()
            });
            let records: Vec<u8> = [1].into_iter().chain(records).collect();
            let names: [&'static str; 2] = match name {
                "take-off" => ["take-off-bytes", "take-off"],
                "offboard" => ["offboard-bytes", "offboard"],
                "mission" => ["mission-bytes", "mission"],
                "parameters" => ["parameters-bytes", "parameters"],
                _ => ["requests-bytes", "requests"],
            };
            [(names[0], [&[0], &*stream].concat()), (names[1], records)]
        })
        .collect()
}

fn save(target: &str, name: &str, bytes: &[u8]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds").join(target);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(name), bytes).unwrap();
}

fn frames<M: Message>(messages: &[M]) -> Vec<Vec<u8>> {
    let mut encoder = Encoder::default();
    let mut frame = [0; MAX_FRAME];
    messages.iter().map(|message| encoder.encode(message, &mut frame).unwrap().to_vec()).collect()
}

/// Tag, sequence and message of a frame.
fn content_of(frame: &[u8]) -> Vec<u8> {
    let mut payload = frame.to_vec();
    let length = cobs::decode_in_place(&mut payload).unwrap();
    payload[..length - 4].to_vec()
}

/// Messages of a host, and the answers of a vehicle on the ground.
fn conversation() -> (Vec<Uplink>, Vec<Downlink>) {
    let name: heapless::String<48> = "cascade.k1".try_into().unwrap();
    let mut uplink = vec![
        Uplink::Hello,
        Uplink::ParameterAt { index: 3 },
        Uplink::ParameterRead { name: name.clone() },
        Uplink::ParameterWrite { name: name.clone(), value: f32::NAN },
        Uplink::ParametersPersist,
        Uplink::Subscribe { period: 20 },
        Uplink::SelectController(ControllerKind::Saturated),
        Uplink::FaultAcknowledge,
    ];
    uplink.extend(uploads().into_iter().flat_map(|(_, messages)| messages));
    let mut memory = SessionMemory::new();
    let mut session = session(&mut memory);
    let mut downlink = Vec::new();
    for message in &uplink {
        let received = Received { sequence: 42, message: message.clone() };
        session.handle(received, GROUND, TickOrigin::Timer);
        downlink.extend(std::iter::from_fn(|| session.next_answer()));
    }
    uplink.push(Uplink::Command(Command::Start));
    uplink.push(Uplink::State { tick: 1000, state: VehicleState::at_rest(Vec3::ONE) });
    uplink.push(Uplink::Reference { tick: 300, reference: Reference::hover(Vec3::ONE) });
    (uplink, downlink)
}

/// Writes every parameter's own value, and twice that.
fn writes(kind: ControllerKind) -> Vec<u8> {
    let mut memory = SessionMemory::new();
    let mut session = session(&mut memory);
    send(&mut session, Uplink::SelectController(kind), GROUND);
    let mut bytes = vec![kind as u8];
    for index in 0.. {
        let Downlink::Parameter(parameter) =
            send(&mut session, Uplink::ParameterAt { index }, GROUND)
        else {
            return bytes;
        };
        for value in [parameter.value, 2.0 * parameter.value] {
            bytes.push(index as u8);
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}

/// One trajectory of each kind.
fn uploads() -> Vec<(&'static str, Vec<Uplink>)> {
    use TrajectorySelection as S;
    let centre_world = Vec3::new(0.0, 1.0, 2.0);
    let leg = |index, x| Uplink::PathLeg { index, leg: Leg::to(Vec3::new(x, 0.0, 1.0), 20.0) };
    let select = |selection| vec![Uplink::SelectTrajectory(selection)];
    vec![
        (
            "path",
            vec![
                Uplink::PathBegin { start_world: Vec3::Z, yaw: 0.5, legs: 3 },
                leg(0, 1.0),
                leg(1, 0.0),
                leg(2, -1.0),
                Uplink::SelectTrajectory(S::UploadedPath),
            ],
        ),
        ("stream", select(S::Stream)),
        ("hover", select(S::Hover(HoverConfig { position_world: centre_world, yaw: 1.0 }))),
        (
            "rising-circle",
            select(S::RisingCircle(RisingCircleConfig {
                radius: 1.0,
                angular_rate: 0.2,
                height: 1.0,
                rise_rate: 0.1,
            })),
        ),
        (
            "circle",
            select(S::Circle(CircleConfig {
                centre_world,
                radius: 1.0,
                angular_rate: 0.2,
                heading: Heading::Tangent,
            })),
        ),
        (
            "lemniscate",
            select(S::Lemniscate(LemniscateConfig {
                centre_world,
                amplitude_x: 1.0,
                amplitude_y: 0.5,
                angular_rate: 0.2,
                yaw: 0.5,
            })),
        ),
    ]
}
