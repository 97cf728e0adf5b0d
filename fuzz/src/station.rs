//! A station on MAVLink, and a vehicle that is where its reference is.

use ctrl_core::controller::AdaptiveController;
use ctrl_core::mode::Mode;
use ctrl_core::vehicle::VehicleState;
use firmware::exchange::ControlStatus;
use firmware::flight_control::{FlightControl, Health, Inputs};
use firmware::pilot::{Pilot, PilotedVehicle};
use firmware::session::{HostSession, SessionMemory};
use firmware::state_sample::StateSample;
use firmware::vehicle::VEHICLE;
use glam::Vec3;
use mavlink::Message;
use mavlink::dialects::common::MavMessage;
use mavlink_vehicle::{Decoder, Line, Protocol, ProtocolConfig, ProtocolMemory, SigningKey, View};

/// Numbers of the messages that the protocol understands.
pub const MESSAGES: [u32; 26] = [
    0, 4, 11, 20, 21, 23, 40, 41, 43, 44, 45, 47, 51, 73, 75, 76, 82, 84, 86, 110, 111, 117, 119,
    121, 122, 256,
];

/// A frame of MAVLink 2 from station 255, with the right checksum.
///
/// # Panics
/// If the payload is longer than 255 bytes.
#[must_use]
pub fn frame(id: u32, payload: &[u8]) -> Vec<u8> {
    let [id0, id1, id2, _] = id.to_le_bytes();
    let length = u8::try_from(payload.len()).expect("a payload");
    let mut frame = vec![0xfd, length, 0, 0, 0, 255, 190, id0, id1, id2];
    frame.extend_from_slice(payload);
    let crc = mavlink::calculate_crc(&frame[1..], MavMessage::extra_crc(id));
    frame.extend(crc.to_le_bytes());
    frame
}

/// Memory of a flight.
#[derive(Default)]
pub struct FlightMemory {
    session: SessionMemory,
    protocol: ProtocolMemory,
}

/// The image's vehicle with its pilot, ready to be armed.
pub struct PilotedFlight<'m> {
    session: HostSession<'m>,
    pilot: Pilot,
    control: FlightControl,
    protocol: Protocol<'m>,
    decoder: Decoder,
    status: ControlStatus,
    state: VehicleState,
    armed: bool,
}

impl<'m> PilotedFlight<'m> {
    /// On the ground, with a fresh state; with a key, which nobody guesses, nothing that comes may have an effect.
    ///
    /// # Panics
    /// If the image's own configuration is refused.
    #[must_use]
    pub fn new(memory: &'m mut FlightMemory, signing_key: Option<SigningKey>) -> Self {
        let FlightMemory { session: memory, protocol } = memory;
        let config = ProtocolConfig { signing_key, ..ProtocolConfig::default() };
        let protocol = Protocol::new(&config, protocol);
        let session = crate::session(memory);
        let law = session.law();
        let mut flight = Self {
            pilot: Pilot::new(&Pilot::moderate(law), law).unwrap(),
            control: FlightControl::new(law, &VEHICLE.supervisor, &VEHICLE.geometry).unwrap(),
            session,
            protocol,
            decoder: Decoder::new(),
            status: ControlStatus::default(),
            state: VehicleState::at_rest(Vec3::ZERO),
            armed: false,
        };
        flight.tick(u32::from(VEHICLE.supervisor.fresh_samples));
        flight
    }

    /// Takes bytes from the station.
    pub fn receive(&mut self, bytes: &[u8]) {
        let (status, view) = (self.status, self.view());
        let Self { session, pilot, protocol, decoder, .. } = self;
        let mut vehicle = PilotedVehicle { pilot, session, status, view };
        for packet in bytes.iter().filter_map(|byte| decoder.push(*byte)) {
            protocol.handle(&packet, Line::Secure, &mut vehicle);
        }
    }

    /// Returns `true` if the vehicle was ever armed.
    #[must_use]
    pub fn armed(&self) -> bool {
        self.armed
    }

    /// Control ticks, each followed by what the vehicle sends.
    ///
    /// # Panics
    /// When a reference or a wrench leaves its bounds, the vehicle flies without having been armed, or sends
    /// without end.
    pub fn tick(&mut self, ticks: u32) {
        for _ in 0..ticks {
            let reference = self.pilot.step(self.status.mode, Some(&self.state)).reference;
            if let Some(law) = self.session.take_law() {
                self.control.replace_law(law);
            }
            let law = self.session.law();
            let pull = reference.acceleration_world.abs().max_element();
            assert!(pull <= law.reference_acceleration_max(), "{reference:?}");
            assert!(reference.position_world.is_finite() && reference.snap_world.is_finite());
            let inputs = Inputs {
                sample: Some(StateSample { state: self.state, age_ticks: 0 }),
                reference,
                command: self.pilot.next_command(false),
                overrun: false,
                fault: false,
                outputs_off: false,
                kill: false,
                health: Health::default(),
            };
            let outputs = self.control.tick(&inputs);
            if let Some(answer) = outputs.answer {
                self.pilot.answered(answer);
            }
            self.armed |= outputs.mode == Mode::Armed;
            assert!(self.armed || outputs.mode == Mode::Disarmed, "{outputs:?}");
            if outputs.mode == Mode::Flying {
                let (bounds, wrench) = (law.bounds(), outputs.wrench);
                assert!((bounds.thrust_min..=bounds.thrust_max).contains(&wrench.thrust));
                assert!(wrench.torque_body.abs().cmple(bounds.torque_max).all());
                let position = reference.position_world;
                self.state.position_world = position.with_z(position.z.max(0.0));
                self.state.velocity_world = reference.velocity_world;
            }
            let uptime = self.status.uptime + 1;
            self.status =
                ControlStatus { mode: outputs.mode, flight_tick: outputs.flight_tick, uptime };
            self.send();
        }
    }

    fn send(&mut self) {
        let (status, view) = (self.status, self.view());
        let Self { session, pilot, protocol, .. } = self;
        let mut vehicle = PilotedVehicle { pilot, session, status, view };
        let sent = (0..500).take_while(|_| protocol.next_frame(&mut vehicle).is_some()).count();
        assert!(sent < 500, "it sends without end");
    }

    fn view(&self) -> View {
        View {
            time: u64::from(self.status.uptime) * 1000,
            mode: self.status.mode,
            cause: self.control.cause(),
            state: Some(self.state),
            ready: self.control.readiness(),
            thrust: 0.0,
            load: 0.0,
            battery: None,
            lasting: None,
        }
    }
}
