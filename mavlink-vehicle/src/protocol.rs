//! The state machine between ground stations and a vehicle.

use ctrl_core::mode::navigation::NavigationEvent;
use ctrl_core::mode::safety::Reaction;
use ctrl_core::mode::{Cause, Mode, Refusal};
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
use crate::status_text::{Part, Severity, StatusTexts};
use crate::stream::Streams;
use crate::vehicle::{Vehicle, View};

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

/// The large parts of a protocol, kilobytes, in memory that the caller provides: zero at first, filled in place
/// and never moved.
#[derive(Debug)]
pub struct ProtocolMemory {
    answers: Deque<Frame, ANSWERS>,
    texts: StatusTexts,
    pub(crate) mission: MissionStore,
}

impl ProtocolMemory {
    /// No answers, no sentences, no mission.
    #[must_use]
    pub const fn new() -> Self {
        Self { answers: Deque::new(), texts: StatusTexts::new(), mission: MissionStore::new() }
    }
}

impl Default for ProtocolMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// The state machine of a vehicle on MAVLink; one for all its connections.
#[derive(Debug)]
pub struct Protocol<'m> {
    pub(crate) config: ProtocolConfig,
    pub(crate) memory: &'m mut ProtocolMemory,
    sequence: u8,
    dropped: u32,
    pub(crate) streams: Streams,
    pub(crate) pending: Option<PendingCommand>,
    pub(crate) logs: LogTransfer,
    /// Parameter of the list that comes next.
    pub(crate) listed: Option<u16>,
    /// Mode of `AVAILABLE_MODES` that comes next, from one.
    pub(crate) next_mode: u8,
    announced: Option<Mode>,
    /// The next frame is a stream's, if one is due.
    stream_turn: bool,
    /// The latest estimate of the integral action that was sent is the torque's.
    pub(crate) torque_turn: bool,
    pub(crate) signing: Signing,
}

impl<'m> Protocol<'m> {
    /// Nothing has come yet.
    #[must_use]
    pub fn new(config: &ProtocolConfig, memory: &'m mut ProtocolMemory) -> Self {
        Self {
            config: *config,
            memory,
            sequence: 0,
            dropped: 0,
            streams: Streams::new(config.stretch),
            pending: None,
            logs: LogTransfer::default(),
            listed: None,
            next_mode: 0,
            announced: None,
            stream_turn: false,
            torque_turn: true,
            signing: Signing::new(config.signing_key, config.signing_link),
        }
    }

    /// Answers that found no room.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Sends a sentence to the ground stations.
    pub fn say(&mut self, severity: Severity, parts: &[Part<'_>]) {
        self.memory.texts.push(severity, parts);
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
        if self.check(packet, vehicle.view().time) {
            self.obey(packet, line, vehicle);
        }
    }

    /// First half of [`handle`](Self::handle), without the vehicle: `true` if a packet is signed as it must be. A hash
    /// takes long; `time` is that of the vehicle's view (us).
    pub fn check(&mut self, packet: &Packet, time: u64) -> bool {
        let Err(refusal) = self.signing.accept(packet) else { return true };
        if self.signing.says(time) {
            let parts = [
                Part::Text("message "),
                Part::Count(packet.id),
                Part::Text(" refused: "),
                Part::Text(refusal.as_str()),
            ];
            self.say(Severity::Warning, &parts);
        }
        false
    }

    /// Second half of [`handle`](Self::handle), for a packet that has passed [`check`](Self::check).
    pub fn obey<V: Vehicle>(&mut self, packet: &Packet, line: Line, vehicle: &mut V) {
        let Some(message) = Incoming::of(packet) else { return };
        let (system, component) = message.target(packet);
        let ours = (system == 0 || system == self.config.system)
            && (component == 0 || component == COMPONENT);
        let own = packet.system == self.config.system && packet.component == COMPONENT;
        if !ours || own {
            return;
        }
        vehicle.hear();
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
                self.say(Severity::Warning, &[Part::Text("logs are not erased from here")]);
            }
            Incoming::SetupSigning(data) => self.set_up_signing(&data, line, vehicle),
        }
    }

    /// The next frame to send at the vehicle's time, if there is one.
    ///
    /// Streams that are due have every other frame, so that no flood of requests silences the heartbeat; then
    /// come answers, sentences, lists that are on their way, and logs. The caller takes as many as its line carries.
    pub fn next_frame<V: Vehicle>(&mut self, vehicle: &mut V) -> Option<Frame> {
        let mut frame = self.next_unsigned_frame(vehicle)?;
        self.sign(&mut frame);
        Some(frame)
    }

    /// First half of [`next_frame`](Self::next_frame).
    pub fn next_unsigned_frame<V: Vehicle>(&mut self, vehicle: &mut V) -> Option<Frame> {
        self.finish_command(vehicle);
        self.report_events(vehicle);
        self.repeat_mission_request(vehicle.view().time);
        self.stream_turn = !self.stream_turn;
        let first = if self.stream_turn { self.due_stream(vehicle) } else { None };
        first.or_else(|| self.requested(vehicle))
    }

    /// Second half of [`next_frame`](Self::next_frame), without the vehicle: signs a frame, if there is a key.
    pub fn sign(&mut self, frame: &mut Frame) {
        frame.sign(&mut self.signing);
    }

    /// The next frame that was asked for, or else of a stream.
    fn requested<V: Vehicle>(&mut self, vehicle: &mut V) -> Option<Frame> {
        if let Some(frame) = self.memory.answers.pop_front() {
            return Some(frame);
        }
        if let Some((data, extension)) = self.memory.texts.next() {
            return Some(self.frame(&data, &extension));
        }
        let listed = self.next_parameter(vehicle).or_else(|| self.next_available_mode());
        let due = listed.or_else(|| self.due_stream(vehicle));
        due.or_else(|| self.next_log_frame(vehicle))
    }

    fn due_stream<V: Vehicle>(&mut self, vehicle: &mut V) -> Option<Frame> {
        let View { time, lasting, .. } = vehicle.view();
        let id = self.streams.take_due(time, lasting.is_some())?;
        self.telemetry(id, vehicle)
    }

    /// Drops the answers that wait: they are not signed as they would have to be with another key.
    pub(crate) fn drop_answers(&mut self) {
        self.memory.answers.clear();
    }

    /// Queues an answer.
    pub(crate) fn answer<D: MessageData>(&mut self, data: &D, extension: &[u8]) {
        let frame = self.frame(data, extension);
        self.queue(frame);
    }

    /// Queues an answer whose fields the crate's enumerations cannot hold.
    pub(crate) fn answer_bytes(&mut self, message: (u32, u8), payload: &[u8]) {
        let frame =
            Frame::of_payload(self.sender(), message, payload, self.signing.key().is_some());
        self.queue(frame);
    }

    pub(crate) fn queue(&mut self, frame: Frame) {
        if self.memory.answers.push_back(frame).is_err() {
            self.dropped = self.dropped.wrapping_add(1);
        }
    }

    pub(crate) fn frame<D: MessageData>(&mut self, data: &D, extension: &[u8]) -> Frame {
        Frame::new(self.sender(), data, extension, self.signing.key().is_some())
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
        let View { mode, cause, .. } = vehicle.view();
        let before = self.announced.replace(mode);
        if before.is_some_and(|before| before != mode) {
            self.say_mode(mode, cause);
        }
        let Some(event) = vehicle.take_event() else { return };
        match event {
            NavigationEvent::TakenOff => self.say(Severity::Info, &[Part::Text("take-off done")]),
            NavigationEvent::ItemReached(seq) => {
                self.answer(&MISSION_ITEM_REACHED_DATA { seq }, &[]);
            }
            NavigationEvent::MissionFinished => {
                self.say(Severity::Info, &[Part::Text("mission finished")]);
            }
            NavigationEvent::OffboardLost => {
                self.say(Severity::Critical, &[Part::Text("set-points lost: hold")]);
            }
            NavigationEvent::Landed => self.say(Severity::Info, &[Part::Text("landed")]),
            NavigationEvent::TakeOffFailed => {
                self.say(Severity::Critical, &[Part::Text("does not lift: disarmed")]);
            }
            NavigationEvent::HazardRaised(hazards, reaction) => {
                let action = match reaction {
                    Some(Reaction::Return) => ": returning",
                    Some(Reaction::Land) => ": landing",
                    Some(Reaction::Failsafe) => ": descending",
                    Some(Reaction::Stop) => ": rotors cut",
                    Some(Reaction::Warn) | None => "",
                };
                self.say(Severity::Critical, &[Part::Hazards(hazards), Part::Text(action)]);
            }
        }
    }
}

impl Protocol<'_> {
    /// Tells a new mode of the supervisor, and the cause of one that is safer.
    fn say_mode(&mut self, mode: Mode, cause: Option<Cause>) {
        let (severity, words) = match (mode, cause) {
            (Mode::Disarmed, None) => (Severity::Info, "disarmed"),
            (Mode::Disarmed, Some(_)) => (Severity::Critical, "disarmed"),
            (Mode::Armed, _) => (Severity::Info, "armed"),
            (Mode::Flying, _) => (Severity::Info, "flying"),
            (Mode::Failsafe, _) => (Severity::Critical, "failsafe, descending"),
            (Mode::Locked, _) => (Severity::Critical, "rotors stopped and locked, disarm first"),
        };
        match cause {
            Some(cause) if severity == Severity::Critical => {
                self.say(
                    severity,
                    &[Part::Text(words), Part::Text(": "), Part::Text(cause.as_str())],
                );
            }
            _ => self.say(severity, &[Part::Text(words)]),
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
