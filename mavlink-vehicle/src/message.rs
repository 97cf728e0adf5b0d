//! The dialect: which messages are understood, as structs of the crate `mavlink`.
//!
//! Commands and mission items are read field by field, since a number that the crate's enumerations do
//! not have deserves an answer, too.

use mavlink::dialects::common::{
    FILE_TRANSFER_PROTOCOL_DATA, HEARTBEAT_DATA, LOG_ERASE_DATA, LOG_REQUEST_DATA_DATA,
    LOG_REQUEST_END_DATA, LOG_REQUEST_LIST_DATA, MISSION_ACK_DATA, MISSION_CLEAR_ALL_DATA,
    MISSION_COUNT_DATA, MISSION_REQUEST_DATA, MISSION_REQUEST_INT_DATA, MISSION_REQUEST_LIST_DATA,
    MISSION_SET_CURRENT_DATA, PARAM_REQUEST_LIST_DATA, PARAM_REQUEST_READ_DATA, PARAM_SET_DATA,
    PING_DATA, SET_ATTITUDE_TARGET_DATA, SET_MODE_DATA, SET_POSITION_TARGET_GLOBAL_INT_DATA,
    SET_POSITION_TARGET_LOCAL_NED_DATA, SETUP_SIGNING_DATA, TIMESYNC_DATA,
};
use mavlink::{MavlinkVersion, MessageData};

use crate::decoder::Packet;

/// `COMMAND_INT`: number and extra byte of the checksum.
pub(crate) const COMMAND_INT: (u32, u8) = (75, 158);
/// `COMMAND_LONG`.
pub(crate) const COMMAND_LONG: (u32, u8) = (76, 152);
/// `COMMAND_ACK`.
pub(crate) const COMMAND_ACK: (u32, u8) = (77, 143);
/// `MISSION_ITEM_INT`.
pub(crate) const MISSION_ITEM_INT: (u32, u8) = (73, 38);

/// A message that is understood.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to put a file transfer on")]
pub enum Incoming {
    /// Another system is there.
    Heartbeat(HEARTBEAT_DATA),
    /// A command with seven numbers.
    CommandLong(Order),
    /// A command with a place.
    CommandInt(Order),
    /// Selects a mode; superseded by a command.
    SetMode(SET_MODE_DATA),
    /// Asks for every parameter.
    ParameterList(PARAM_REQUEST_LIST_DATA),
    /// Asks for a parameter.
    ParameterRead(PARAM_REQUEST_READ_DATA),
    /// Writes a parameter.
    ParameterSet(PARAM_SET_DATA),
    /// Clock comparison.
    TimeSync(TIMESYNC_DATA),
    /// Round trip.
    Ping(PING_DATA),
    /// Set-point in local coordinates.
    LocalTarget(SET_POSITION_TARGET_LOCAL_NED_DATA),
    /// Set-point in global coordinates.
    GlobalTarget(SET_POSITION_TARGET_GLOBAL_INT_DATA),
    /// Set-point of the attitude.
    AttitudeTarget(SET_ATTITUDE_TARGET_DATA),
    /// Begins an upload.
    MissionCount(MISSION_COUNT_DATA),
    /// An item of an upload.
    MissionItem(Item),
    /// Asks for the number of items.
    MissionList(MISSION_REQUEST_LIST_DATA),
    /// Asks for an item.
    MissionRequest(u16),
    /// Ends a download.
    MissionAck(MISSION_ACK_DATA),
    /// Forgets the mission.
    MissionClear(MISSION_CLEAR_ALL_DATA),
    /// Selects an item.
    MissionSetCurrent(MISSION_SET_CURRENT_DATA),
    /// A request for files.
    FileTransfer(FILE_TRANSFER_PROTOCOL_DATA),
    /// Asks which logs there are.
    LogList(LOG_REQUEST_LIST_DATA),
    /// Asks for a part of a log.
    LogData(LOG_REQUEST_DATA_DATA),
    /// Ends the transfer of logs.
    LogEnd(LOG_REQUEST_END_DATA),
    /// Asks to delete all logs.
    LogErase(LOG_ERASE_DATA),
    /// Sets the key of signatures.
    SetupSigning(SETUP_SIGNING_DATA),
}

/// A command of either message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// Number of the command.
    pub command: u16,
    /// Parameters 1 to 4.
    pub parameters: [f32; 4],
    /// Parameters 5 and 6: in [`Place::Float`] as numbers, in [`Place::Scaled`] as a place.
    pub place: Place,
    /// Parameter 7.
    pub z: f32,
    /// Frame of the place.
    pub frame: u8,
    target: (u8, u8),
}

/// Parameters 5 and 6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Numbers; a place is in degrees.
    Float(f32, f32),
    /// Integers; a place is in 1e-7 degrees or 1e-4 m.
    Scaled(i32, i32),
}

/// An item of a mission as it came, for download.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Item {
    /// Parameters 1 to 4.
    pub parameters: [f32; 4],
    /// Latitude (1e-7 deg) or x (1e-4 m).
    pub x: i32,
    /// Longitude (1e-7 deg) or y (1e-4 m).
    pub y: i32,
    /// Altitude (m).
    pub z: f32,
    /// From zero.
    pub sequence: u16,
    /// Number of the command.
    pub command: u16,
    /// Frame of the place.
    pub frame: u8,
    /// One if the mission goes on by itself.
    pub autocontinue: u8,
    /// Kind of list.
    pub mission_type: u8,
}

/// The extra byte of the checksum of a message that is understood.
pub(crate) fn extra_crc(id: u32) -> Option<u8> {
    match id {
        75 => return Some(COMMAND_INT.1),
        76 => return Some(COMMAND_LONG.1),
        73 => return Some(MISSION_ITEM_INT.1),
        _ => {}
    }
    macro_rules! known {
        ($($data:ty,)*) => {
            match id {
                $(<$data>::ID => Some(<$data>::EXTRA_CRC),)*
                _ => None,
            }
        };
    }
    known!(
        HEARTBEAT_DATA,
        SET_MODE_DATA,
        PARAM_REQUEST_LIST_DATA,
        PARAM_REQUEST_READ_DATA,
        PARAM_SET_DATA,
        TIMESYNC_DATA,
        PING_DATA,
        SET_POSITION_TARGET_LOCAL_NED_DATA,
        SET_POSITION_TARGET_GLOBAL_INT_DATA,
        SET_ATTITUDE_TARGET_DATA,
        MISSION_COUNT_DATA,
        MISSION_REQUEST_LIST_DATA,
        MISSION_REQUEST_INT_DATA,
        MISSION_REQUEST_DATA,
        MISSION_ACK_DATA,
        MISSION_CLEAR_ALL_DATA,
        MISSION_SET_CURRENT_DATA,
        FILE_TRANSFER_PROTOCOL_DATA,
        LOG_REQUEST_LIST_DATA,
        LOG_REQUEST_DATA_DATA,
        LOG_REQUEST_END_DATA,
        LOG_ERASE_DATA,
        SETUP_SIGNING_DATA,
    )
}

impl Incoming {
    /// The message of a packet; none if a field holds what the message does not allow.
    #[must_use]
    pub fn of(packet: &Packet) -> Option<Self> {
        fn data<D: MessageData>(packet: &Packet) -> Option<D> {
            D::deser(MavlinkVersion::V2, packet.payload()).ok()
        }
        Some(match packet.id {
            HEARTBEAT_DATA::ID => Self::Heartbeat(data(packet)?),
            75 => Self::CommandInt(Order::from_int(packet)),
            76 => Self::CommandLong(Order::from_long(packet)),
            73 => Self::MissionItem(Item::of(packet)),
            SET_MODE_DATA::ID => Self::SetMode(data(packet)?),
            PARAM_REQUEST_LIST_DATA::ID => Self::ParameterList(data(packet)?),
            PARAM_REQUEST_READ_DATA::ID => Self::ParameterRead(data(packet)?),
            PARAM_SET_DATA::ID => Self::ParameterSet(data(packet)?),
            TIMESYNC_DATA::ID => Self::TimeSync(data(packet)?),
            PING_DATA::ID => Self::Ping(data(packet)?),
            SET_POSITION_TARGET_LOCAL_NED_DATA::ID => Self::LocalTarget(data(packet)?),
            SET_POSITION_TARGET_GLOBAL_INT_DATA::ID => Self::GlobalTarget(data(packet)?),
            SET_ATTITUDE_TARGET_DATA::ID => Self::AttitudeTarget(data(packet)?),
            MISSION_COUNT_DATA::ID => Self::MissionCount(data(packet)?),
            MISSION_REQUEST_LIST_DATA::ID => Self::MissionList(data(packet)?),
            MISSION_REQUEST_INT_DATA::ID | MISSION_REQUEST_DATA::ID => {
                Self::MissionRequest(packet.u16_at(0))
            }
            MISSION_ACK_DATA::ID => Self::MissionAck(data(packet)?),
            MISSION_CLEAR_ALL_DATA::ID => Self::MissionClear(data(packet)?),
            MISSION_SET_CURRENT_DATA::ID => Self::MissionSetCurrent(data(packet)?),
            FILE_TRANSFER_PROTOCOL_DATA::ID => Self::FileTransfer(data(packet)?),
            LOG_REQUEST_LIST_DATA::ID => Self::LogList(data(packet)?),
            LOG_REQUEST_DATA_DATA::ID => Self::LogData(data(packet)?),
            LOG_REQUEST_END_DATA::ID => Self::LogEnd(data(packet)?),
            LOG_ERASE_DATA::ID => Self::LogErase(data(packet)?),
            SETUP_SIGNING_DATA::ID => Self::SetupSigning(data(packet)?),
            _ => return None,
        })
    }

    /// System and component that the message is for; zero for all.
    #[must_use]
    pub fn target(&self, packet: &Packet) -> (u8, u8) {
        let at = |index: usize| (packet.byte(index), packet.byte(index + 1));
        match self {
            Self::Heartbeat(_) | Self::TimeSync(_) => (0, 0),
            Self::CommandLong(order) | Self::CommandInt(order) => order.target,
            Self::SetMode(data) => (data.target_system, 0),
            Self::ParameterList(data) => (data.target_system, data.target_component),
            Self::ParameterRead(data) => (data.target_system, data.target_component),
            Self::ParameterSet(data) => (data.target_system, data.target_component),
            Self::Ping(data) => (data.target_system, data.target_component),
            Self::LocalTarget(data) => (data.target_system, data.target_component),
            Self::GlobalTarget(data) => (data.target_system, data.target_component),
            Self::AttitudeTarget(data) => (data.target_system, data.target_component),
            Self::MissionCount(data) => (data.target_system, data.target_component),
            Self::MissionItem(_) => at(32),
            Self::MissionList(data) => (data.target_system, data.target_component),
            Self::MissionRequest(_) => at(2),
            Self::MissionAck(data) => (data.target_system, data.target_component),
            Self::MissionClear(data) => (data.target_system, data.target_component),
            Self::MissionSetCurrent(data) => (data.target_system, data.target_component),
            Self::FileTransfer(data) => (data.target_system, data.target_component),
            Self::LogList(data) => (data.target_system, data.target_component),
            Self::LogData(data) => (data.target_system, data.target_component),
            Self::LogEnd(data) => (data.target_system, data.target_component),
            Self::LogErase(data) => (data.target_system, data.target_component),
            Self::SetupSigning(data) => (data.target_system, data.target_component),
        }
    }
}

impl Order {
    fn from_long(packet: &Packet) -> Self {
        let [p1, p2, p3, p4, p5, p6, p7] = [0, 4, 8, 12, 16, 20, 24].map(|at| packet.f32_at(at));
        Self {
            command: packet.u16_at(28),
            parameters: [p1, p2, p3, p4],
            place: Place::Float(p5, p6),
            z: p7,
            frame: 0, // global
            target: (packet.byte(30), packet.byte(31)),
        }
    }

    fn from_int(packet: &Packet) -> Self {
        Self {
            command: packet.u16_at(28),
            parameters: [0, 4, 8, 12].map(|at| packet.f32_at(at)),
            place: Place::Scaled(packet.i32_at(16), packet.i32_at(20)),
            z: packet.f32_at(24),
            frame: packet.byte(32),
            target: (packet.byte(30), packet.byte(31)),
        }
    }
}

impl Item {
    /// All numbers zero.
    pub(crate) const ZERO: Self = Self {
        parameters: [0.0; 4],
        x: 0,
        y: 0,
        z: 0.0,
        sequence: 0,
        command: 0,
        frame: 0,
        autocontinue: 0,
        mission_type: 0,
    };

    fn of(packet: &Packet) -> Self {
        Self {
            parameters: [0, 4, 8, 12].map(|at| packet.f32_at(at)),
            x: packet.i32_at(16),
            y: packet.i32_at(20),
            z: packet.f32_at(24),
            sequence: packet.u16_at(28),
            command: packet.u16_at(30),
            frame: packet.byte(34),
            autocontinue: packet.byte(36),
            mission_type: packet.byte(37),
        }
    }

    /// The payload of `MISSION_ITEM_INT` for a station.
    pub(crate) fn payload(&self, station: (u8, u8), current: bool) -> [u8; 38] {
        let mut payload = [0; 38];
        let numbers = self.parameters.iter().flat_map(|x| x.to_le_bytes());
        let place = self.x.to_le_bytes().into_iter().chain(self.y.to_le_bytes());
        let rest = self.z.to_le_bytes().into_iter().chain(self.sequence.to_le_bytes());
        let (system, component) = station;
        let ends =
            [system, component, self.frame, current.into(), self.autocontinue, self.mission_type];
        let bytes = numbers.chain(place).chain(rest).chain(self.command.to_le_bytes()).chain(ends);
        // wcet: at most 38 iterations
        payload.iter_mut().zip(bytes).for_each(|(place, byte)| *place = byte);
        payload
    }
}
