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
use fuzz::{GROUND, send, session};
use glam::Vec3;
use link::{ControllerKind, Downlink, Encoder, MAX_FRAME, Message, TrajectorySelection, Uplink};

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
    for (name, messages) in uploads() {
        let bytes: Vec<_> = messages.iter().flat_map(|m| postcard::to_stdvec(m).unwrap()).collect();
        save("trajectory_upload", name, &bytes);
    }
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
    let downlink =
        uplink.iter().map(|message| send(&mut session, message.clone(), GROUND)).collect();
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
