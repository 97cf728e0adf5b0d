//! Commands: `COMMAND_LONG`, `COMMAND_INT`, `SET_MODE`, and their acknowledgements.

use ctrl_core::error::ConfigError;
use ctrl_core::mode::navigation::{Airborne, NavigationMode, NavigationRefusal, Request};
use ctrl_core::mode::{Command, Mode, Refusal};
use ctrl_core::setpoint::Setpoint;
use glam::Vec3;
use mavlink::dialects::common::{
    AUTOPILOT_VERSION_DATA, MavProtocolCapability, MavResult, PROTOCOL_VERSION_DATA,
};

use crate::coordinates::{ned, yaw_ned};
use crate::flight_mode::FlightMode;
use crate::message::{COMMAND_ACK, Order, Place};
use crate::protocol::{Protocol, ProtocolConfig, result_of};
use crate::status_text::{Part, Severity, explained};
use crate::vehicle::Vehicle;

/// Time after which a command that the supervisor does not answer has failed (us).
const ANSWER_TIMEOUT: u64 = 1_000_000;
/// Parameter 2 of a disarm or an arm that is forced.
const FORCE: f32 = 21196.0;

/// Numbers of the commands that are carried out.
mod number {
    pub const LOITER_UNLIMITED: u16 = 17;
    pub const RETURN: u16 = 20;
    pub const LAND: u16 = 21;
    pub const TAKE_OFF: u16 = 22;
    pub const SET_MODE: u16 = 176;
    pub const CHANGE_SPEED: u16 = 178;
    pub const SET_HOME: u16 = 179;
    pub const FLIGHT_TERMINATION: u16 = 185;
    pub const REPOSITION: u16 = 192;
    pub const PAUSE_CONTINUE: u16 = 193;
    pub const SET_MISSION_CURRENT: u16 = 224;
    pub const SET_STANDARD_MODE: u16 = 262;
    pub const MISSION_START: u16 = 300;
    pub const ARM_DISARM: u16 = 400;
    pub const GET_MESSAGE_INTERVAL: u16 = 510;
    pub const SET_MESSAGE_INTERVAL: u16 = 511;
    pub const REQUEST_MESSAGE: u16 = 512;
    pub const REQUEST_PROTOCOL_VERSION: u16 = 519;
    pub const REQUEST_CAPABILITIES: u16 = 520;
}

/// A command that waits for the supervisor's answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PendingCommand {
    command: u16,
    station: (u8, u8),
    since: u64,
}

/// Result of a command, or none while the supervisor has it.
type Outcome = Result<Option<MavResult>, Denial>;

/// A refusal with its result.
enum Denial {
    Navigation(NavigationRefusal),
    Supervisor(Refusal),
    Reason(MavResult, &'static str),
}

impl From<NavigationRefusal> for Denial {
    fn from(refusal: NavigationRefusal) -> Self {
        Self::Navigation(refusal)
    }
}

impl From<ConfigError> for Denial {
    fn from(error: ConfigError) -> Self {
        Self::Navigation(error.into())
    }
}

impl From<Refusal> for Denial {
    fn from(refusal: Refusal) -> Self {
        Self::Supervisor(refusal)
    }
}

const ACCEPTED: Outcome = Ok(Some(MavResult::MAV_RESULT_ACCEPTED));
const UNSUPPORTED: Outcome = Ok(Some(MavResult::MAV_RESULT_UNSUPPORTED));

impl Protocol<'_> {
    /// Carries out a command and acknowledges it.
    pub(crate) fn order<V: Vehicle>(&mut self, order: &Order, station: (u8, u8), vehicle: &mut V) {
        let result = match self.carry_out(order, station, vehicle) {
            Ok(None) => return, // acknowledged with the supervisor's answer
            Ok(Some(result)) => result,
            Err(denial) => self.explain(order.command, &denial),
        };
        self.acknowledge(order.command, result, station);
    }

    /// Selects a mode by its number, as the old message does, without an acknowledgement.
    pub(crate) fn set_mode<V: Vehicle>(&mut self, custom: u32, vehicle: &mut V) {
        let mode = FlightMode::with_custom(custom);
        if let Err(denial) = self.enter(mode, vehicle) {
            self.explain(number::SET_MODE, &denial);
        }
    }

    fn carry_out<V: Vehicle>(
        &mut self,
        order: &Order,
        station: (u8, u8),
        vehicle: &mut V,
    ) -> Outcome {
        let [first, second, ..] = order.parameters;
        let mode = vehicle.view().mode;
        match order.command {
            number::ARM_DISARM if first == 1.0 => {
                self.supervise(Command::Arm, order, station, vehicle)
            }
            number::ARM_DISARM if first == 0.0 => {
                let ours = vehicle.out_of_command().is_none();
                let standing = ours && vehicle.navigator().airborne() == Airborne::Ground;
                if matches!(mode, Mode::Flying | Mode::Failsafe) && !standing && second != FORCE {
                    let reason = "in flight: land first";
                    return Err(Denial::Reason(MavResult::MAV_RESULT_DENIED, reason));
                }
                self.supervise(Command::Disarm, order, station, vehicle)
            }
            number::FLIGHT_TERMINATION if first >= 1.0 => {
                self.supervise(Command::Kill, order, station, vehicle)
            }
            number::TAKE_OFF => {
                let height = self.height(order, vehicle);
                ask(vehicle, Request::TakeOff(height))
            }
            number::LAND => {
                let place = self.place(order, vehicle);
                ask(vehicle, Request::Land(place))
            }
            number::RETURN => ask(vehicle, Request::Return),
            number::LOITER_UNLIMITED => ask(vehicle, Request::Hold),
            number::PAUSE_CONTINUE if first == 0.0 => ask(vehicle, Request::Hold),
            number::PAUSE_CONTINUE => ask(vehicle, Request::Mission),
            number::REPOSITION => self.reposition(order, vehicle),
            number::MISSION_START => {
                if first > 0.0 {
                    vehicle.navigator().set_current_item(first as usize)?;
                }
                ask(vehicle, Request::Mission)
            }
            number::SET_MISSION_CURRENT => {
                vehicle.navigator().set_current_item(first.max(0.0) as usize)?;
                ACCEPTED
            }
            number::SET_MODE => {
                // Main and sub-mode, or the whole number where a station sends it so.
                let [_, _, third, _] = order.parameters;
                let by_number = FlightMode::with_custom(second as u32);
                self.enter(FlightMode::with_main_and_sub(second, third).or(by_number), vehicle)
            }
            number::SET_STANDARD_MODE => self.enter(FlightMode::with_standard(first), vehicle),
            number::CHANGE_SPEED => {
                if second > 0.0 {
                    vehicle.navigator().set_speed(second)?;
                }
                ACCEPTED
            }
            number::SET_HOME => {
                let here = vehicle.view().state.map(|state| state.position_world);
                let place = if first == 1.0 { here } else { self.place(order, vehicle) };
                let place = place
                    .ok_or(Denial::Reason(MavResult::MAV_RESULT_DENIED, "home needs a place"))?;
                vehicle.navigator().set_home(place)?;
                ACCEPTED
            }
            number::SET_MESSAGE_INTERVAL => {
                if self.streams.set(first.max(0.0) as u32, second) {
                    ACCEPTED
                } else {
                    let reason = "no such stream, or faster than 200 Hz";
                    Err(Denial::Reason(MavResult::MAV_RESULT_DENIED, reason))
                }
            }
            number::GET_MESSAGE_INTERVAL => {
                self.send_interval(first);
                ACCEPTED
            }
            number::REQUEST_MESSAGE => self.send_requested(first, second, vehicle),
            number::REQUEST_PROTOCOL_VERSION => {
                self.send_protocol_version();
                ACCEPTED
            }
            number::REQUEST_CAPABILITIES => {
                self.send_version();
                ACCEPTED
            }
            _ => UNSUPPORTED,
        }
    }

    /// Hands a command to the supervisor; it is acknowledged with the answer.
    fn supervise<V: Vehicle>(
        &mut self,
        command: Command,
        order: &Order,
        station: (u8, u8),
        vehicle: &mut V,
    ) -> Outcome {
        if let (Some(pending), Command::Kill) = (self.pending, command) {
            self.acknowledge(pending.command, MavResult::MAV_RESULT_CANCELLED, pending.station);
        } else if self.pending.is_some() {
            let reason = "another command is on its way";
            return Err(Denial::Reason(MavResult::MAV_RESULT_TEMPORARILY_REJECTED, reason));
        }
        vehicle.command(command)?;
        let since = vehicle.view().time;
        self.pending = Some(PendingCommand { command: order.command, station, since });
        Ok(None)
    }

    /// Acknowledges the command that waits, once it is answered or has waited too long.
    pub(crate) fn finish_command<V: Vehicle>(&mut self, vehicle: &mut V) {
        let answer = vehicle.take_answer();
        let Some(pending) = self.pending else { return };
        let result = match answer {
            Some(Ok(_)) => MavResult::MAV_RESULT_ACCEPTED,
            Some(Err(refusal)) => self.explain(pending.command, &Denial::Supervisor(refusal)),
            None if vehicle.view().time.saturating_sub(pending.since) < ANSWER_TIMEOUT => return,
            None => MavResult::MAV_RESULT_FAILED,
        };
        self.pending = None;
        self.acknowledge(pending.command, result, pending.station);
    }

    /// Says why a command was refused; its result.
    fn explain(&mut self, command: u16, denial: &Denial) -> MavResult {
        let [start, number, refused] =
            [Part::Text("command "), Part::Count(command.into()), Part::Text(" refused: ")];
        let (reason, result) = match denial {
            Denial::Navigation(NavigationRefusal::Invalid(error)) => {
                let [a, b, c, d, e, f, g, h] = explained(error);
                let all = [start, number, refused, a, b, c, d, e, f, g, h];
                self.say(Severity::Warning, &all);
                return MavResult::MAV_RESULT_DENIED;
            }
            Denial::Navigation(refusal) => {
                (refusal.as_str(), MavResult::MAV_RESULT_TEMPORARILY_REJECTED)
            }
            Denial::Supervisor(Refusal::Hazard(hazards)) => {
                self.say(Severity::Warning, &[start, number, refused, Part::Hazards(*hazards)]);
                return result_of(Refusal::Hazard(*hazards));
            }
            Denial::Supervisor(refusal) => (refusal.as_str(), result_of(*refusal)),
            Denial::Reason(result, reason) => (*reason, *result),
        };
        self.say(Severity::Warning, &[start, number, refused, Part::Text(reason)]);
        result
    }

    /// Says which number is out of its bound.
    pub(crate) fn say_invalid(&mut self, what: &str, error: &ConfigError) {
        let [a, b, c, d, e, f, g, h] = explained(error);
        self.say(Severity::Warning, &[Part::Text(what), a, b, c, d, e, f, g, h]);
    }

    fn acknowledge(&mut self, command: u16, result: MavResult, station: (u8, u8)) {
        let [low, high] = command.to_le_bytes();
        // Progress and a second parameter of the result are not used.
        let payload = [low, high, result as u8, 0, 0, 0, 0, 0, station.0, station.1];
        self.answer_bytes(COMMAND_ACK, &payload);
    }

    /// Enters a mode as if its command had come.
    fn enter<V: Vehicle>(&mut self, mode: Option<FlightMode>, vehicle: &mut V) -> Outcome {
        let Some(mode) = mode else {
            let reason = "no such mode; there is no manual mode";
            return Err(Denial::Reason(MavResult::MAV_RESULT_UNSUPPORTED, reason));
        };
        ask(
            vehicle,
            match mode.navigation {
                NavigationMode::Hold => Request::Hold,
                NavigationMode::TakeOff => Request::TakeOff(None),
                NavigationMode::Mission => Request::Mission,
                NavigationMode::Offboard => Request::Offboard,
                NavigationMode::Return => Request::Return,
                NavigationMode::Land => Request::Land(None),
            },
        )
    }

    fn reposition<V: Vehicle>(&mut self, order: &Order, vehicle: &mut V) -> Outcome {
        let place = self.place(order, vehicle).ok_or(Denial::Reason(
            MavResult::MAV_RESULT_DENIED,
            "no place, or a frame that is not understood",
        ))?;
        let [speed, _, _, yaw] = order.parameters;
        if speed > 0.0 {
            vehicle.navigator().set_speed(speed)?;
        }
        let setpoint = Setpoint::at(place);
        let yaw = yaw.is_finite().then(|| yaw_ned(yaw)); // rad, by this command's definition
        ask(vehicle, Request::GoTo(Setpoint { yaw, ..setpoint }))
    }

    /// The height of a take-off in the world frame (m); none for NaN.
    fn height<V: Vehicle>(&self, order: &Order, vehicle: &mut V) -> Option<f32> {
        order.z.is_finite().then(|| self.altitude(order.frame, order.z, vehicle))
    }

    /// An altitude in the world frame (m).
    pub(crate) fn altitude<V: Vehicle>(&self, frame: u8, z: f32, vehicle: &mut V) -> f32 {
        height(&self.config, frame, z, vehicle.navigator().home_world())
    }

    /// The place of a command in the world frame (m); none if it states none.
    fn place<V: Vehicle>(&self, order: &Order, vehicle: &mut V) -> Option<Vec3> {
        let here = vehicle.view().state?.position_world;
        let height =
            if order.z.is_finite() { self.altitude(order.frame, order.z, vehicle) } else { here.z };
        match (order.place, order.frame) {
            (Place::Scaled(x, y), 1) => {
                Some(ned(Vec3::new(x as f32 * 1e-4, y as f32 * 1e-4, -height)))
            }
            // MAVLink's mark for no coordinate.
            (Place::Scaled(i32::MAX, _) | Place::Scaled(_, i32::MAX), _) => None,
            (Place::Scaled(latitude, longitude), 0 | 3 | 5 | 6) => {
                let world = self.config.origin.world(latitude, longitude, 0.0);
                Some(Vec3::new(world.x, world.y, height))
            }
            (Place::Float(latitude, longitude), _)
                if latitude.is_finite()
                    && longitude.is_finite()
                    && (latitude != 0.0 || longitude != 0.0) =>
            {
                // Saturates at what no globe has, which the reach of the references refuses.
                let scaled = |degrees: f32| (f64::from(degrees) * 1e7) as i32;
                let world = self.config.origin.world(scaled(latitude), scaled(longitude), 0.0);
                Some(Vec3::new(world.x, world.y, height))
            }
            _ => None,
        }
    }

    fn send_requested<V: Vehicle>(&mut self, id: f32, index: f32, vehicle: &mut V) -> Outcome {
        match id.max(0.0) as u32 {
            148 => self.send_version(),
            300 => self.send_protocol_version(),
            435 => self.next_mode = if index >= 1.0 { 0x80 | (index as u8).min(0x7f) } else { 1 },
            id => match self.telemetry(id, vehicle) {
                Some(frame) => self.queue(frame),
                None => return UNSUPPORTED,
            },
        }
        ACCEPTED
    }

    fn send_version(&mut self) {
        use MavProtocolCapability as Can;
        let capabilities = Can::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
            | Can::MAV_PROTOCOL_CAPABILITY_MISSION_INT
            | Can::MAV_PROTOCOL_CAPABILITY_COMMAND_INT
            | Can::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
            | Can::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
            | Can::MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
            | Can::MAV_PROTOCOL_CAPABILITY_MAVLINK2;
        let data = AUTOPILOT_VERSION_DATA {
            capabilities,
            uid: u64::from(self.config.system),
            flight_sw_version: self.config.version,
            flight_custom_version: self.config.version_hash,
            ..AUTOPILOT_VERSION_DATA::DEFAULT
        };
        self.answer(&data, &[]);
    }

    fn send_protocol_version(&mut self) {
        let data = PROTOCOL_VERSION_DATA {
            version: 200,
            min_version: 100,
            max_version: 200,
            spec_version_hash: [0; 8],
            library_version_hash: [0; 8],
        };
        self.answer(&data, &[]);
    }
}

/// The height in the world frame (m) of an altitude `z` in a frame.
pub(crate) fn height(config: &ProtocolConfig, frame: u8, z: f32, home: Vec3) -> f32 {
    match frame {
        3 | 6 => home.z + z,             // above home
        1 => -z,                         // local NED
        _ => z - config.origin.altitude, // above mean sea level
    }
}

fn ask<V: Vehicle>(vehicle: &mut V, request: Request) -> Outcome {
    if let Some(reason) = vehicle.out_of_command() {
        return Err(Denial::Reason(MavResult::MAV_RESULT_TEMPORARILY_REJECTED, reason));
    }
    let mode = vehicle.view().mode;
    vehicle.navigator().request(mode, request)?;
    ACCEPTED
}
