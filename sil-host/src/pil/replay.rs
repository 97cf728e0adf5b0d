//! A [`Recording`] fed back: to the image, whose answers must be the same, and to the law on the host.

use ctrl_core::controller::{AdaptiveController, LastingEstimates};
use ctrl_core::mode::Mode;
use ctrl_core::trajectory::Trajectory;
use ctrl_core::vehicle::VehicleState;
use link::{Decoder, Downlink, Encoder, Identity, MAX_FRAME, Message, Telemetry, Uplink};

use super::PilError;
use super::comparison::{Difference, Step, first_difference, lasting};
use super::emulator::Emulator;
use super::lockstep::{Lockstep, PATIENCE};
use super::recording::{Direction, Recording};
use sim::scenario::{LoadedScenario, Scenario};

/// Result of a replay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replayed {
    /// Control ticks of flight that the law on the host flew again.
    pub host_ticks: u64,
    /// First difference of the recorded vehicle from the law on the host.
    pub host_difference: Option<Difference>,
    /// Packets that the image answered again.
    pub packets: usize,
    /// Number of the first packet that the image answered otherwise.
    pub image_difference: Option<usize>,
}

impl Replayed {
    /// `true` if host and image repeated the recording.
    #[must_use]
    pub fn same(&self) -> bool {
        self.host_difference.is_none() && self.image_difference.is_none()
    }
}

/// Feeds a recording to the law on the host and to the image.
///
/// # Errors
/// When its scenario cannot be flown, or the image does not run.
pub fn replay(recording: &Recording, emulator: &Emulator) -> Result<Replayed, PilError> {
    let loaded = LoadedScenario::parse(&recording.scenario, &recording.text, &[])?;
    let (host_ticks, host_difference) = on_host(recording, &loaded)?;
    let (packets, image_difference) = on_image(recording, emulator)?;
    Ok(Replayed { host_ticks, host_difference, packets, image_difference })
}

/// Steps the law through the recorded samples of flight; ticks, and the first difference.
fn on_host(
    recording: &Recording,
    loaded: &LoadedScenario,
) -> Result<(u64, Option<Difference>), PilError> {
    let refusal = |error| loaded.refusal(&error);
    let scenario = loaded.scenario();
    let law = scenario.controller.build().map_err(refusal)?;
    steps(&law, recording, scenario).map_err(|error| refusal(error).into())
}

fn steps<C: AdaptiveController>(
    law: &C,
    recording: &Recording,
    scenario: &Scenario,
) -> Result<(u64, Option<Difference>), ctrl_core::error::ConfigError> {
    let trajectory = scenario.trajectory.build(law.step_period())?;
    let mut state = law.initial_state();
    let flown = flown(recording);
    for (tick, Flown { sample, telemetry, lasting }) in flown.iter().enumerate() {
        let tick = tick as u64;
        let output = law.step(&mut state, sample, &trajectory.reference(tick));
        let host = Step::made(law, output, &state);
        let difference = first_difference(tick, &Step::told(telemetry, *lasting), &host);
        if difference.is_some() {
            return Ok((tick, difference));
        }
    }
    Ok((flown.len() as u64, None))
}

/// A tick of flight.
struct Flown {
    sample: VehicleState,
    telemetry: Telemetry,
    lasting: Option<LastingEstimates>,
}

/// Each sample of flight with what the vehicle made of it. The vehicle holds the last good sample when
/// one is missed.
fn flown(recording: &Recording) -> Vec<Flown> {
    let (mut uplink, mut downlink) = (Decoder::default(), Decoder::default());
    let (mut sample, mut flown) = (None, Vec::new());
    for (direction, bytes) in &recording.packets {
        match direction {
            Direction::ToVehicle => {
                for message in messages(&mut uplink, bytes) {
                    if let Uplink::State { state, .. } = message {
                        sample = Some(state);
                    }
                }
            }
            Direction::FromVehicle => {
                let received = messages(&mut downlink, bytes);
                for message in &received {
                    if let (Downlink::Telemetry(telemetry), Some(sample)) = (message, sample)
                        && telemetry.mode == Mode::Flying
                    {
                        let lasting = lasting(&received, telemetry.tick);
                        flown.push(Flown { sample, telemetry: *telemetry, lasting });
                    }
                }
            }
        }
    }
    flown
}

fn messages<M: Message>(decoder: &mut Decoder<M>, bytes: &[u8]) -> Vec<M> {
    let received = bytes.iter().filter_map(|byte| decoder.push(*byte));
    received.map(|received| received.message).collect()
}

/// Sends the image what it was sent; packets, and the first that it answers otherwise.
fn on_image(
    recording: &Recording,
    emulator: &Emulator,
) -> Result<(usize, Option<usize>), PilError> {
    let mut line = Lockstep::start(emulator, &[])?;
    let (mut recorded, mut received) = (Decoder::default(), Decoder::default());
    let mut answered = 0;
    for (direction, bytes) in &recording.packets {
        match direction {
            Direction::ToVehicle => line.send(bytes)?,
            Direction::FromVehicle => {
                let packet = line.receive(PATIENCE)?;
                if comparable(&mut recorded, bytes) != comparable(&mut received, &packet) {
                    return Ok((answered, Some(answered)));
                }
                answered += 1;
            }
        }
    }
    Ok((answered, None))
}

/// The messages of a packet as bytes, without the parts that depend on execution time or version.
fn comparable(decoder: &mut Decoder<Downlink>, packet: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for message in messages(decoder, packet) {
        let message = match message {
            Downlink::Health(_) => continue,
            Downlink::Telemetry(telemetry) => {
                Downlink::Telemetry(Telemetry { step_cost: 0, ..telemetry })
            }
            Downlink::Identity(identity) => {
                Downlink::Identity(Identity { firmware: Default::default(), ..identity })
            }
            other => other,
        };
        let mut frame = [0; MAX_FRAME];
        if let Ok(frame) = Encoder::default().encode(&message, &mut frame) {
            bytes.extend_from_slice(frame);
        }
    }
    bytes
}
