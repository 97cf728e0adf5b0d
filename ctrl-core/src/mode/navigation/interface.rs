//! What goes in and out of the modes: configuration, missions, requests, refusals, events.

use core::fmt;

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::error::ConfigError;
use crate::mode::Command;
use crate::mode::safety::{Hazards, Reaction};
use crate::reference::Reference;
use crate::setpoint::{Setpoint, ShaperConfig};

/// Source of the set-point in flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub enum NavigationMode {
    /// At rest where it is, or on the way to a place that was asked for.
    #[default]
    Hold,
    /// Straight up to an altitude.
    TakeOff,
    /// Item by item of the mission.
    Mission,
    /// Set-points of another computer.
    Offboard,
    /// Up, home and down.
    Return,
    /// Straight down to the ground.
    Land,
}

/// Limits and defaults of the modes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct NavigationConfig {
    /// Limits of the references.
    pub shaper: ShaperConfig,
    /// Height of a take-off that states none, above its place (m).
    pub take_off_altitude: f32,
    /// Height at which Return flies home, above home (m).
    pub return_altitude: f32,
    /// Speed of the descent to the ground (m/s).
    pub land_speed: f32,
    /// Distance at which a waypoint counts as reached (m).
    pub acceptance_radius: f32,
    /// Silence of the set-points after which Offboard ends (s).
    pub setpoint_timeout: f32,
}

/// Kind of a mission's item.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MissionKind {
    /// Straight up to the height of the place; on the ground it starts the flight.
    TakeOff,
    /// To the place, and stay for a time (s).
    #[default]
    Waypoint,
    /// To the place, and stay.
    Loiter,
    /// To the place at the height that is flown, then down.
    Land,
    /// As [`NavigationMode::Return`].
    Return,
    /// Another horizontal speed (m/s) from here.
    Speed(f32),
}

/// Item of a mission.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MissionItem {
    /// Action of the item.
    pub kind: MissionKind,
    /// Place (m).
    pub position_world: Vec3,
    /// Heading at the place (rad).
    pub yaw: Option<f32>,
    /// Time at the place (s).
    pub hold_time: f32,
    /// Number of the item for whoever sent it.
    pub number: u16,
}

/// Request to the navigation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// Stop here, and stay.
    Hold,
    /// Straight up to the height (m) in the world frame; `None`: the configured height.
    TakeOff(Option<f32>),
    /// To a place, and stay.
    GoTo(Setpoint),
    /// Fly the mission from its current item.
    Mission,
    /// Follow the streamed set-points.
    Offboard,
    /// Fly home and land.
    Return,
    /// Land; at a place, if one is given (m).
    Land(Option<Vec3>),
}

/// Reason for the refusal of a request.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum NavigationRefusal {
    /// Arm first.
    NotArmed,
    /// Only in flight: take off first.
    NotFlying,
    /// There is no mission.
    NoMission,
    /// No set-point came within the timeout.
    NoSetpoint,
    /// The item does not exist.
    NoItem,
    /// A hazard is present: only towards the ground.
    Hazard,
    /// A number is outside its bound.
    Invalid(ConfigError),
}

impl NavigationRefusal {
    /// The reason in words; the parameter that is out of its bound.
    #[must_use]
    pub const fn as_str(&self) -> &'static str {
        match self {
            Self::NotArmed => "not armed",
            Self::NotFlying => "not in flight: take off first",
            Self::NoMission => "no mission",
            Self::NoSetpoint => "no set-points are coming",
            Self::Hazard => "a hazard is present: return or land",
            Self::NoItem => "no such mission item",
            Self::Invalid(error) => error.parameter,
        }
    }
}

impl fmt::Display for NavigationRefusal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Invalid(error) => error.fmt(out),
            _ => out.write_str(self.as_str()),
        }
    }
}

impl core::error::Error for NavigationRefusal {}

impl From<ConfigError> for NavigationRefusal {
    fn from(error: ConfigError) -> Self {
        Self::Invalid(error)
    }
}

/// Something that happened by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NavigationEvent {
    /// The altitude of the take-off is reached.
    TakenOff,
    /// The item with this number is done.
    ItemReached(u16),
    /// The last item is done.
    MissionFinished,
    /// The set-points fell silent: Hold.
    OffboardLost,
    /// At rest on the ground.
    Landed,
    /// The vehicle does not lift: disarmed.
    TakeOffFailed,
    /// These hazards have come up; what is done about them.
    HazardRaised(Hazards, Option<Reaction>),
}

/// Contact with the ground, from the vehicle's state and its reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Airborne {
    /// On the ground, or not in flight.
    #[default]
    Ground,
    /// Rising from the ground.
    TakingOff,
    /// In the air.
    Air,
    /// Coming down to land.
    Landing,
}

/// Result of one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Navigation {
    /// Reference of the tick.
    pub reference: Reference,
    /// Command to the supervisor.
    pub command: Option<Command>,
    /// An event of the tick.
    pub event: Option<NavigationEvent>,
}
