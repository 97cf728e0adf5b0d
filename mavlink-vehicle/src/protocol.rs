//! The state machine between ground stations and a vehicle.

use core::fmt;

use ctrl_core::mode::navigation::NavigationEvent;
use ctrl_core::mode::safety::Reaction;
use ctrl_core::mode::{Mode, Refusal};
use heapless::Deque;
use mavlink::MessageData;
use mavlink::dialects::common::{
    FILE_TRANSFER_PROTOCOL_DATA, MISSION_ITEM_REACHED_DATA, MavResult, PING_DATA, TIMESYNC_DATA,
};

use crate::command::PendingCommand;
use crate::coordinates::Origin;
use crate::decoder::Packet;
use crate::frame::{Frame, Sender};
use crate::log_transfer::LogTransfer;
use crate::message::Incoming;
use crate::mission::MissionStore;
use crate::signing::{Line, Signing, SigningKey, SigningRefusals};
use crate::status_text::{Severity, StatusTexts};
use crate::stream::Streams;
use crate::vehicle::Vehicle;

/// Answers that wait to be sent.
const ANSWERS: usize = 12;

/// Claim about the autopilot in heartbeats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Autopilot {
    /// A generic one, which is the truth.
    #[default]
    Generic,
    /// PX4, for ground stations that know no other with these modes.
    Px4,
}

/// Settings of the protocol.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProtocolConfig {
    /// Number of the system, from one.
    pub system: u8,
    /// Claim in heartbeats.
    pub autopilot: Autopilot,
    /// Place of the world frame's origin.
    pub origin: Origin,
    /// Factor on the intervals of all streams but the heartbeat; one for a fast link.
    pub stretch: u32,
    /// First eight digits of the version's hash.
    pub version_hash: [u8; 8],
    /// `major << 24 | minor << 16 | patch << 8`.
    pub version: u32,
    /// Key of signatures: with one, everything that is sent is signed, and what comes must be.
    pub signing_key: Option<SigningKey>,
    /// Number of the link in signatures of what is sent.
    pub signing_link: u8,
}

impl Default for ProtocolConfig {
    /// System 1, generic, on a field near Zurich at sea level.
    fn default() -> Self {
        Self {
            system: 1,
            autopilot: Autopilot::Generic,
            origin: Origin { latitude: 473_977_420, longitude: 85_455_940, altitude: 0.0 },
            stretch: 1,
            version_hash: [0; 8],
            version: 0x0001_0000,
            signing_key: None,
            signing_link: 0,
        }
    }
}

/// Component of an autopilot.
pub(crate) const COMPONENT: u8 = 1;

/// The state machine of a vehicle on MAVLink; one for all its connections.
#[derive(Clone, Debug)]
pub struct Protocol {
    pub(crate) config: ProtocolConfig,
    sequence: u8,
    answers: Deque<Frame, ANSWERS>,
    dropped: u32,
    pub(crate) texts: StatusTexts,
    pub(crate) streams: Streams,
    pub(crate) pending: Option<PendingCommand>,
    pub(crate) mission: MissionStore,
    pub(crate) logs: LogTransfer,
    /// Parameter of the list that comes next.
    pub(crate) listed: Option<u16>,
    /// Mode of `AVAILABLE_MODES` that comes next, from one.
    pub(crate) next_mode: u8,
    announced: Option<Mode>,
    pub(crate) signing: Signing,
}

impl Protocol {
    /// Nothing has come yet.
    #[must_use]
    pub fn new(config: &ProtocolConfig) -> Self {
        Self {
            config: *config,
            sequence: 0,
            answers: Deque::new(),
            dropped: 0,
            texts: StatusTexts::new(),
            streams: Streams::new(config.stretch),
            pending: None,
            mission: MissionStore::new(),
            logs: LogTransfer::default(),
            listed: None,
            next_mode: 0,
            announced: None,
            signing: Signing::new(config.signing_key, config.signing_link),
        }
    }

    /// Answers that found no room.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Sends a sentence to the ground stations.
    pub fn say(&mut self, severity: Severity, text: fmt::Arguments<'_>) {
        self.texts.push(severity, text);
    }

    /// Tells the time for signatures: 10 us since 2015-01-01. Without a clock it is enough that it grows, from a
    /// number that no earlier start of the program has reached.
    pub fn follow_clock(&mut self, timestamp: u64) {
        self.signing.follow_clock(timestamp);
    }

    /// Messages that were refused for their signature.
    #[must_use]
    pub fn signing_refusals(&self) -> SigningRefusals {
        self.signing.refusals()
    }

    /// Carries out a packet, unless it is for another system or component, or not signed as it must be.
    pub fn handle<V: Vehicle>(&mut self, packet: &Packet, line: Line, vehicle: &mut V) {
        if let Err(refusal) = self.signing.accept(packet) {
            if self.signing.says(vehicle.view().time) {
                let id = packet.id;
                self.say(Severity::Warning, format_args!("message {id} refused: {refusal}"));
            }
            return;
        }
        let Some(message) = Incoming::of(packet) else { return };
        let (system, component) = message.target(packet);
        let ours = (system == 0 || system == self.config.system)
            && (component == 0 || component == COMPONENT);
        let own = packet.system == self.config.system && packet.component == COMPONENT;
        if !ours || own {
            return;
        }
        let station = (packet.system, packet.component);
        match message {
            Incoming::Heartbeat(_) => {}
            Incoming::CommandLong(order) | Incoming::CommandInt(order) => {
                self.order(&order, station, vehicle);
            }
            Incoming::SetMode(data) => self.set_mode(data.custom_mode, vehicle),
            Incoming::ParameterList(_) => self.listed = Some(0),
            Incoming::ParameterRead(data) => {
                self.read_parameter(&data.param_id, data.param_index, station, vehicle);
            }
            Incoming::ParameterSet(data) => self.set_parameter(&data, station, vehicle),
            Incoming::TimeSync(data) => self.time_sync(&data, vehicle),
            Incoming::Ping(data) => self.ping(&data, station),
            Incoming::LocalTarget(data) => self.local_target(&data, vehicle),
            Incoming::GlobalTarget(data) => self.global_target(&data, vehicle),
            Incoming::AttitudeTarget(_) => self.attitude_target(),
            Incoming::MissionCount(data) => {
                let kind = packet.byte(4);
                self.begin_upload(data.count, kind, station, vehicle);
            }
            Incoming::MissionItem(item) => self.take_item(item, station, vehicle),
            Incoming::MissionList(_) => self.send_count(packet.byte(2), station),
            Incoming::MissionRequest(sequence) => {
                self.send_item(sequence, packet.byte(4), station, vehicle);
            }
            Incoming::MissionAck(_) => {}
            Incoming::MissionClear(_) => self.clear_mission(packet.byte(2), station, vehicle),
            Incoming::MissionSetCurrent(data) => self.set_current(data.seq, vehicle),
            Incoming::FileTransfer(data) => self.refuse_file_transfer(&data, station),
            Incoming::LogList(data) => self.list_logs(data.start, data.end, vehicle),
            Incoming::LogData(data) => self.send_log(data.id, data.ofs, data.count, vehicle),
            Incoming::LogEnd(_) => self.logs = LogTransfer::default(),
            Incoming::LogErase(_) => {
                self.say(Severity::Warning, format_args!("logs are not erased from here"));
            }
            Incoming::SetupSigning(data) => self.set_up_signing(&data, line, vehicle),
        }
    }

    /// The next frame to send at the vehicle's time, if there is one.
    ///
    /// Answers come first, then lists that are on their way, then streams that are due. The caller takes as
    /// many as its line carries.
    pub fn next_frame<V: Vehicle>(&mut self, vehicle: &mut V) -> Option<Frame> {
        self.finish_command(vehicle);
        self.report_events(vehicle);
        self.repeat_mission_request(vehicle.view().time);
        if let Some(frame) = self.answers.pop_front() {
            return Some(frame);
        }
        if let Some((data, extension)) = self.texts.next() {
            return Some(self.frame(&data, &extension));
        }
        if let Some(frame) = self.next_parameter(vehicle) {
            return Some(frame);
        }
        if let Some(frame) = self.next_available_mode() {
            return Some(frame);
        }
        // A log takes what the streams leave, at least every other frame.
        let stream = self.streams.take_due(vehicle.view().time);
        match stream.and_then(|id| self.telemetry(id, vehicle)) {
            Some(frame) => Some(frame),
            None => self.next_log_frame(vehicle),
        }
    }

    /// Queues an answer.
    pub(crate) fn answer<D: MessageData>(&mut self, data: &D, extension: &[u8]) {
        let frame = self.frame(data, extension);
        self.queue(frame);
    }

    /// Queues an answer whose fields the crate's enumerations cannot hold.
    pub(crate) fn answer_bytes(&mut self, message: (u32, u8), payload: &[u8]) {
        let frame = Frame::of_payload(self.sender(), message, payload, &mut self.signing);
        self.queue(frame);
    }

    pub(crate) fn queue(&mut self, frame: Frame) {
        if self.answers.push_back(frame).is_err() {
            self.dropped = self.dropped.wrapping_add(1);
        }
    }

    pub(crate) fn frame<D: MessageData>(&mut self, data: &D, extension: &[u8]) -> Frame {
        Frame::new(self.sender(), data, extension, &mut self.signing)
    }

    fn sender(&mut self) -> Sender {
        self.sequence = self.sequence.wrapping_add(1);
        Sender { system: self.config.system, component: COMPONENT, sequence: self.sequence }
    }

    fn time_sync<V: Vehicle>(&mut self, data: &TIMESYNC_DATA, vehicle: &V) {
        if data.tc1 == 0 {
            let now = i64::try_from(vehicle.view().time).unwrap_or(i64::MAX).saturating_mul(1000);
            self.answer(&TIMESYNC_DATA { tc1: now, ts1: data.ts1 }, &[]);
        }
    }

    fn ping(&mut self, data: &PING_DATA, station: (u8, u8)) {
        if data.target_system == 0 {
            let (target_system, target_component) = station;
            self.answer(&PING_DATA { target_system, target_component, ..data.clone() }, &[]);
        }
    }

    /// Refuses a request for files, so that the station asks by messages.
    fn refuse_file_transfer(&mut self, data: &FILE_TRANSFER_PROTOCOL_DATA, station: (u8, u8)) {
        const NAK: u8 = 129;
        const FILE_NOT_FOUND: u8 = 10;
        let [s0, s1, session, request, ..] = data.payload;
        let [low, high] = u16::from_le_bytes([s0, s1]).wrapping_add(1).to_le_bytes();
        let mut payload = [0; 251];
        let head = [low, high, session, NAK, 1, request, 0, 0, 0, 0, 0, 0, FILE_NOT_FOUND];
        payload.iter_mut().zip(head).for_each(|(place, byte)| *place = byte);
        let (target_system, target_component) = station;
        let answer = FILE_TRANSFER_PROTOCOL_DATA {
            target_network: 0,
            target_system,
            target_component,
            payload,
        };
        self.answer(&answer, &[]);
    }

    /// Tells what has happened by itself.
    fn report_events<V: Vehicle>(&mut self, vehicle: &mut V) {
        let mode = vehicle.view().mode;
        let before = self.announced.replace(mode);
        if before.is_some_and(|before| before != mode) {
            match mode {
                Mode::Disarmed => self.say(Severity::Info, format_args!("disarmed")),
                Mode::Armed => self.say(Severity::Info, format_args!("armed")),
                Mode::Flying => self.say(Severity::Info, format_args!("flying")),
                Mode::Failsafe => {
                    self.say(Severity::Critical, format_args!("failsafe: descending"));
                }
                Mode::Locked => {
                    self.say(Severity::Critical, format_args!("locked: disarm first"));
                }
            }
        }
        let Some(event) = vehicle.take_event() else { return };
        match event {
            NavigationEvent::TakenOff => self.say(Severity::Info, format_args!("take-off done")),
            NavigationEvent::ItemReached(seq) => {
                self.answer(&MISSION_ITEM_REACHED_DATA { seq }, &[]);
            }
            NavigationEvent::MissionFinished => {
                self.say(Severity::Info, format_args!("mission finished"));
            }
            NavigationEvent::OffboardLost => {
                self.say(Severity::Critical, format_args!("set-points lost: hold"));
            }
            NavigationEvent::TakeOffFailed => {
                self.say(Severity::Critical, format_args!("does not lift: disarmed"));
            }
            NavigationEvent::HazardRaised(hazards, reaction) => {
                let action = match reaction {
                    Some(Reaction::Return) => ": returning",
                    Some(Reaction::Land) => ": landing",
                    Some(Reaction::Failsafe) => ": descending",
                    Some(Reaction::Stop) => ": rotors cut",
                    Some(Reaction::Warn) | None => "",
                };
                self.say(Severity::Critical, format_args!("{hazards}{action}"));
            }
            NavigationEvent::Landed => self.say(Severity::Info, format_args!("landed")),
        }
    }
}

/// The result of a command that the supervisor refused.
pub(crate) fn result_of(refusal: Refusal) -> MavResult {
    match refusal {
        Refusal::StateStale | Refusal::Fault | Refusal::NotArmed | Refusal::Tilted => {
            MavResult::MAV_RESULT_TEMPORARILY_REJECTED
        }
        Refusal::Hazard(_) | Refusal::Killed => MavResult::MAV_RESULT_TEMPORARILY_REJECTED,
        // In failsafe, locked, and whatever else may be added.
        _ => MavResult::MAV_RESULT_DENIED,
    }
}
