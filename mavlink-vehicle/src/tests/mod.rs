//! A station on one side of the protocol and a simple vehicle on the other; everything passes as bytes.

mod bad_input;
mod commands;
mod conversion;
mod decoding;
mod documented;
mod logs;
mod missions;
mod parameters;
mod set_points;
mod signing;
mod telemetry;

use std::vec::Vec;

use ctrl_core::mode::navigation::{
    Navigation, NavigationConfig, NavigationEvent, NavigationMode, Navigator,
};
use ctrl_core::mode::{Cause, Command, Mode, Refusal};
use ctrl_core::setpoint::ShaperConfig;
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use mavlink::dialects::common::{COMMAND_ACK_DATA, COMMAND_LONG_DATA, MavCmd, MavResult};
use mavlink::{MavlinkVersion, MessageData};

use super::frame::{Frame, Sender};
use super::signing::Signing;
use super::*;

/// Configuration of the navigation in these tests.
const NAVIGATION: NavigationConfig = NavigationConfig {
    shaper: ShaperConfig {
        step_period: 0.01,
        acceleration_max: 1.0,
        speed_max: 3.0,
        climb_max: 1.5,
        descent_max: 1.0,
        yaw_rate_max: 1.0,
        smoothing_time: 0.1,
    },
    take_off_altitude: 2.5,
    return_altitude: 5.0,
    land_speed: 0.5,
    acceptance_radius: 0.3,
    setpoint_timeout: 0.5,
};

/// A vehicle that is where its reference is, above the ground.
struct TestVehicle {
    navigator: Navigator,
    mode: Mode,
    state: VehicleState,
    ticks: u64,
    command: Option<Command>,
    answer: Option<Result<Mode, Refusal>>,
    refuses: Option<Refusal>,
    events: Vec<NavigationEvent>,
    gains: [f32; 2],
    logs: Vec<Vec<u8>>,
    armed_ever: bool,
    cause: Option<Cause>,
    heard: u32,
    battery: Option<Battery>,
    lasting: Option<Lasting>,
}

impl TestVehicle {
    fn new() -> Self {
        Self {
            navigator: Navigator::new(&NAVIGATION).unwrap(),
            mode: Mode::Disarmed,
            state: VehicleState::at_rest(Vec3::ZERO),
            ticks: 0,
            command: None,
            answer: None,
            refuses: None,
            events: Vec::new(),
            gains: [0.5, 0.25],
            logs: Vec::new(),
            armed_ever: false,
            cause: None,
            heard: 0,
            battery: None,
            lasting: None,
        }
    }

    /// One control period of 10 ms.
    fn tick(&mut self) {
        self.ticks += 1;
        let Navigation { reference, command, event } =
            self.navigator.step(self.mode, Some(&self.state));
        self.events.extend(event);
        if let Some(command) = self.command.take() {
            let answer = match (self.refuses, command) {
                (Some(refusal), _) => Err(refusal),
                (None, Command::Arm) => Ok(Mode::Armed),
                (None, Command::Kill) => Ok(Mode::Locked),
                (None, _) => Ok(Mode::Disarmed),
            };
            self.mode = answer.unwrap_or(self.mode);
            self.cause = (self.mode == Mode::Locked).then_some(Cause::Killed);
            self.answer = Some(answer);
        }
        match command {
            Some(Command::Start) => self.mode = Mode::Flying,
            Some(Command::Disarm) => self.mode = Mode::Disarmed,
            _ => {}
        }
        self.armed_ever |= self.mode != Mode::Disarmed;
        if self.mode == Mode::Flying {
            let before = self.state.position_world;
            self.state.position_world = reference.position_world.max(Vec3::new(-1e6, -1e6, 0.0));
            self.state.velocity_world = (self.state.position_world - before) * 100.0;
        }
    }
}

impl Vehicle for TestVehicle {
    fn view(&self) -> View {
        View {
            time: self.ticks * 10_000,
            mode: self.mode,
            cause: self.cause,
            state: Some(self.state),
            ready: Ok(()),
            thrust: 0.5,
            load: 0.25,
            battery: self.battery,
            lasting: self.lasting,
        }
    }

    fn navigator(&mut self) -> &mut Navigator {
        &mut self.navigator
    }

    fn command(&mut self, command: Command) -> Result<(), Refusal> {
        self.command = Some(command);
        Ok(())
    }

    fn hear(&mut self) {
        self.heard += 1;
    }

    fn take_answer(&mut self) -> Option<Result<Mode, Refusal>> {
        self.answer.take()
    }

    fn take_event(&mut self) -> Option<NavigationEvent> {
        if self.events.is_empty() { None } else { Some(self.events.remove(0)) }
    }

    fn parameter_count(&self) -> u16 {
        2
    }

    fn parameter_at(&self, index: u16) -> Option<(&'static str, f32)> {
        let names = ["cascade.k1", "uncertainty.disturbance_acceleration"];
        Some((*names.get(usize::from(index))?, self.gains[usize::from(index)]))
    }

    fn write_parameter(&mut self, name: &str, value: f32) -> Result<(), ParameterRefusal> {
        let index = (0..2).find(|index| self.parameter_at(*index).unwrap().0 == name);
        let index = index.ok_or(ParameterRefusal::Unknown)?;
        if self.mode != Mode::Disarmed {
            return Err(ParameterRefusal::NotNow);
        }
        if !(0.0..=1.0).contains(&value) {
            let parameter = heapless::String::try_from(name).unwrap();
            return Err(ParameterRefusal::Invalid { parameter, value, bounds: (0.0, 1.0) });
        }
        self.gains[usize::from(index)] = value;
        Ok(())
    }

    fn log_count(&self) -> u16 {
        self.logs.len() as u16
    }

    fn log(&self, index: u16) -> Option<LogEntry> {
        let size = self.logs.get(usize::from(index))?.len() as u32;
        Some(LogEntry { size, time_utc: 7 })
    }

    fn read_log(&mut self, index: u16, offset: u32, out: &mut [u8]) -> usize {
        let log = &self.logs[usize::from(index)];
        let part = &log[(offset as usize).min(log.len())..];
        let count = part.len().min(out.len());
        out[..count].copy_from_slice(&part[..count]);
        count
    }
}

/// A station, the protocol and the vehicle.
struct Air {
    protocol: Protocol<'static>,
    vehicle: TestVehicle,
    uplink: Decoder,
    /// Packets that the station has received and not yet looked at.
    received: Vec<Packet>,
    sequence: u8,
    /// Signatures of the station.
    signing: Signing,
    line: Line,
}

/// A protocol with memory of its own.
fn protocol(config: &ProtocolConfig) -> Protocol<'static> {
    Protocol::new(config, std::boxed::Box::leak(std::boxed::Box::default()))
}

const STATION: (u8, u8) = (255, 190);

impl Air {
    fn new() -> Self {
        Self::of(&ProtocolConfig::default())
    }

    fn of(config: &ProtocolConfig) -> Self {
        let mut air = Self {
            protocol: protocol(config),
            vehicle: TestVehicle::new(),
            uplink: Decoder::new(),
            received: Vec::new(),
            sequence: 0,
            signing: Signing::new(None, 0),
            line: Line::Secure,
        };
        air.run(0.1);
        air
    }

    /// A vehicle in hold, 2.5 m above the ground.
    fn flying() -> Self {
        let mut air = Self::new();
        assert_eq!(air.command(400, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), Some(0));
        assert_eq!(air.command(22, [f32::NAN; 7]), Some(0));
        air.run(10.0);
        assert_eq!(air.vehicle.navigator.mode(), NavigationMode::Hold);
        air.received.clear();
        air
    }

    /// Bytes from the station.
    fn bytes(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if let Some(packet) = self.uplink.push(*byte) {
                self.protocol.handle(&packet, self.line, &mut self.vehicle);
            }
        }
    }

    fn sender(&mut self) -> Sender {
        self.sequence = self.sequence.wrapping_add(1);
        Sender { system: STATION.0, component: STATION.1, sequence: self.sequence }
    }

    fn send<D: MessageData>(&mut self, data: &D) {
        self.send_extended(data, &[]);
    }

    fn send_extended<D: MessageData>(&mut self, data: &D, extension: &[u8]) {
        let frame = framed(self.sender(), data, extension, &mut self.signing);
        self.bytes(frame.as_bytes());
    }

    /// Ticks for a time (s); the station takes everything that is sent.
    fn run(&mut self, seconds: f32) {
        for _ in 0..(seconds * 100.0).round() as u32 {
            self.vehicle.tick();
            for _ in 0..64 {
                let Some(frame) = self.protocol.next_frame(&mut self.vehicle) else { break };
                self.received.push(sent(&frame));
            }
        }
    }

    /// The messages of a kind that the station has received, removed.
    fn take<D: MessageData>(&mut self) -> Vec<D> {
        let of_kind = |packet: &Packet| packet.id == D::ID;
        let found = self.received.iter().filter(|packet| of_kind(packet));
        let data = found.map(|p| D::deser(MavlinkVersion::V2, p.payload()).unwrap()).collect();
        self.received.retain(|packet| !of_kind(packet));
        data
    }

    /// Sends a command by number and returns the result in its acknowledgement.
    fn command(&mut self, number: u16, parameters: [f32; 7]) -> Option<u8> {
        self.received.retain(|packet| packet.id != COMMAND_ACK_DATA::ID);
        let [param1, param2, param3, param4, param5, param6, param7] = parameters;
        let long = COMMAND_LONG_DATA {
            param1,
            param2,
            param3,
            param4,
            param5,
            param6,
            param7,
            command: MavCmd::default(),
            target_system: 1,
            target_component: 1,
            confirmation: 0,
        };
        let mut payload = [0; 33];
        long.ser(MavlinkVersion::V2, &mut payload);
        payload[28..30].copy_from_slice(&number.to_le_bytes());
        let key = self.signing.key().is_some();
        let mut frame = Frame::of_payload(self.sender(), message::COMMAND_LONG, &payload, key);
        frame.sign(&mut self.signing);
        self.bytes(frame.as_bytes());
        self.run(0.05);
        let answers: Vec<_> =
            self.received.iter().filter(|p| p.id == COMMAND_ACK_DATA::ID).collect();
        assert!(answers.len() <= 1, "answered {} times", answers.len());
        let answer = answers.first()?;
        assert_eq!(answer.u16_at(0), number);
        assert_eq!((answer.byte(8), answer.byte(9)), STATION, "the station that asked");
        Some(answer.byte(2))
    }

    /// Sentences that the station has received, joined where they came in parts.
    fn texts(&mut self) -> Vec<std::string::String> {
        use mavlink::dialects::common::STATUSTEXT_DATA;
        let mut texts: Vec<std::string::String> = Vec::new();
        for packet in self.received.iter().filter(|packet| packet.id == STATUSTEXT_DATA::ID) {
            let data = STATUSTEXT_DATA::deser(MavlinkVersion::V2, packet.payload()).unwrap();
            let text = data.text.to_str().unwrap();
            match (packet.byte(53), texts.last_mut()) {
                (0, _) | (_, None) => texts.push(text.into()),
                (_, Some(last)) => last.push_str(text),
            }
        }
        self.received.retain(|packet| packet.id != STATUSTEXT_DATA::ID);
        texts
    }
}

/// A frame as a station sends it.
fn framed<D: MessageData>(
    sender: Sender,
    data: &D,
    extension: &[u8],
    signing: &mut Signing,
) -> Frame {
    let mut frame = Frame::new(sender, data, extension, signing.key().is_some());
    frame.sign(signing);
    frame
}

/// The packet of a frame that the vehicle sent, as a station reads it: every checksum must be right.
fn sent(frame: &Frame) -> Packet {
    let bytes = frame.as_bytes();
    let (header, rest) = bytes.split_at(10);
    let len = usize::from(header[1]);
    let signed = usize::from(header[2]);
    assert_eq!((header[0], rest.len()), (0xfd, len + 2 + 13 * signed));
    assert_eq!((header[5], header[6]), (1, 1));
    let id = u32::from_le_bytes([header[7], header[8], header[9], 0]);
    use mavlink::dialects::common::MavMessage;
    let extra = <MavMessage as mavlink::Message>::extra_crc(id);
    let crc = mavlink::calculate_crc(&bytes[1..10 + len], extra);
    assert_eq!(crc.to_le_bytes(), rest[len..len + 2], "checksum of message {id}");
    let mut packet = Packet::of_parts(1, 1, id, &rest[..len]);
    packet.header = *bytes.first_chunk().unwrap();
    packet.checksum = crc.to_le_bytes();
    packet.trailer = rest[len + 2..].first_chunk().map(|end| super::signing::Trailer::of(*end));
    packet
}

fn result(result: MavResult) -> Option<u8> {
    Some(result as u8)
}
