//! The vehicle behind the protocol.

use core::fmt;

use ctrl_core::error::ConfigError;
use ctrl_core::mode::navigation::{NavigationEvent, Navigator};
use ctrl_core::mode::{Cause, Command, Mode, Refusal};
use ctrl_core::vehicle::VehicleState;
use glam::Vec3;
use heapless::String;

/// State of the vehicle at one instant, for telemetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Time since the start of the program (us).
    pub time: u64,
    /// Mode of the supervisor.
    pub mode: Mode,
    /// Reason for the latest change to a safer mode.
    pub cause: Option<Cause>,
    /// The latest good state; none if it is stale.
    pub state: Option<VehicleState>,
    /// Readiness to arm, or the reason against it.
    pub ready: Result<(), Refusal>,
    /// Thrust over its upper bound (-).
    pub thrust: f32,
    /// Share of the processor's time in use (-).
    pub load: f32,
    /// The battery, if there is one.
    pub battery: Option<Battery>,
    /// Estimates of the integral action, if the law has any.
    pub lasting: Option<Lasting>,
}

/// Estimates of what lasts of the disturbance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lasting {
    /// `d_hat`: acceleration, world axes (m/s^2).
    pub acceleration_world: Vec3,
    /// `t_hat`: torque, body axes (N m).
    pub torque_body: Vec3,
}

/// State of a battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Battery {
    /// Voltage (V).
    pub voltage: f32,
    /// Current (A).
    pub current: f32,
    /// Rest of its charge (-).
    pub remaining: f32,
}

/// Reason for the refusal of a parameter.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ParameterRefusal {
    /// No parameter of that name.
    Unknown,
    /// Not now: in flight, or while something is being stored.
    NotNow,
    /// The whole configuration would not be valid.
    Invalid {
        /// The parameter or expression that would violate its bounds.
        parameter: String<48>,
        /// Its value.
        value: f32,
        /// Its bounds.
        bounds: (f32, f32),
    },
}

impl fmt::Display for ParameterRefusal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => out.write_str("no such parameter"),
            Self::NotNow => out.write_str("only on the ground, disarmed"),
            Self::Invalid { parameter, value, bounds: (lower, upper) } => {
                write!(out, "{parameter} = {value} is not in [{lower}, {upper}]")
            }
        }
    }
}

impl core::error::Error for ParameterRefusal {}

impl From<ConfigError> for ParameterRefusal {
    fn from(error: ConfigError) -> Self {
        let mut parameter = String::new();
        // wcet: at most 48 iterations
        for character in error.parameter.chars() {
            if parameter.push(character).is_err() {
                break;
            }
        }
        let bounds = error.bound.ends();
        Self::Invalid { parameter, value: error.value, bounds }
    }
}

/// A log of a flight that can be fetched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LogEntry {
    /// Length (bytes).
    pub size: u32,
    /// Seconds since 1970; zero if not known.
    pub time_utc: u32,
}

/// A vehicle that a [`Protocol`](crate::Protocol) speaks for: the parameters of the link's session, the
/// supervisor, and the navigator. Every call returns at once.
pub trait Vehicle {
    /// The state now.
    fn view(&self) -> View;

    /// The modes of the flight.
    fn navigator(&mut self) -> &mut Navigator;

    /// The reason for which nothing but arming and a forced disarm is carried out now: somebody else flies the
    /// vehicle, for example, so that references are not the navigator's.
    fn out_of_command(&self) -> Option<&'static str> {
        None
    }

    /// Hands a command to the supervisor; [`take_answer`](Self::take_answer) returns its answer.
    ///
    /// # Errors
    /// While another command is on its way.
    fn command(&mut self, command: Command) -> Result<(), Refusal>;

    /// Takes note of a message of a station: the link is not lost.
    fn hear(&mut self) {}

    /// The answer to the latest command, once.
    fn take_answer(&mut self) -> Option<Result<Mode, Refusal>>;

    /// The next event, once.
    fn take_event(&mut self) -> Option<NavigationEvent>;

    /// Number of parameters.
    fn parameter_count(&self) -> u16;

    /// Name in the link and value of the parameter at `index`.
    fn parameter_at(&self, index: u16) -> Option<(&'static str, f32)>;

    /// Writes a parameter by its name in the link, if the whole configuration is then valid.
    ///
    /// # Errors
    /// Returns the reason for a refusal; the value in force is then unchanged.
    fn write_parameter(&mut self, name: &str, value: f32) -> Result<(), ParameterRefusal>;

    /// Number of logs.
    fn log_count(&self) -> u16 {
        0
    }

    /// The log at `index`.
    fn log(&self, _index: u16) -> Option<LogEntry> {
        None
    }

    /// Reads a log from `offset` on; the number of bytes read.
    fn read_log(&mut self, _index: u16, _offset: u32, _out: &mut [u8]) -> usize {
        0
    }
}
