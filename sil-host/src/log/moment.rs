//! One logged tick, and the set-points derived from it.

use ctrl_core::mode::navigation::NavigationMode;
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::WrenchBounds;
use glam::{DMat3, DQuat, DVec3};

use sim::tick::Tick;

/// One tick of a flight with the bounds that normalise its command.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// The tick.
    pub tick: Tick,
    /// The set in which every wrench of the controller lies.
    pub bounds: WrenchBounds,
    /// Thrust of each rotor over its limit; NaN for one that stands still or is not there.
    pub motors: [f32; MOTORS],
    /// Mode of the flight.
    pub status: LoggedStatus,
}

/// Rotors in PX4's topic.
pub const MOTORS: usize = 12;

/// Mode of the flight at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoggedStatus {
    /// `true` while the vehicle is armed.
    pub armed: bool,
    /// Mode of the navigation; offboard in a flight along a trajectory.
    pub navigation: NavigationMode,
}

impl LoggedStatus {
    /// Armed, along a trajectory.
    pub const ON_TRAJECTORY: Self = Self { armed: true, navigation: NavigationMode::Offboard };

    /// PX4's `arming_state`.
    #[must_use]
    pub const fn arming_state(self) -> u8 {
        if self.armed { 2 } else { 1 }
    }

    /// PX4's `nav_state`.
    #[must_use]
    pub const fn navigation_state(self) -> u8 {
        match self.navigation {
            NavigationMode::Mission => 3,
            NavigationMode::Hold => 4,
            NavigationMode::Return => 5,
            NavigationMode::Offboard => 14,
            NavigationMode::TakeOff => 17,
            NavigationMode::Land => 18,
        }
    }
}

impl Moment {
    /// The attitude at which the law's error would be none: `q_d`, for controller 2 `q_a ⊗ q_d`.
    #[must_use]
    pub fn attitude_setpoint(&self) -> DQuat {
        self.tick.truth.attitude * self.tick.evaluation.attitude_error.inverse()
    }

    /// The body rate at which the law's error would be none: `mu`, for controller 2 `mu + w_a`
    /// (rad/s).
    #[must_use]
    pub fn rate_setpoint_body(&self) -> DVec3 {
        self.tick.truth.rate_body - self.tick.evaluation.rate_error
    }
}

/// The attitude of a vehicle that follows the reference exactly: axes `b2d x b3d`, `b2d`, `b3d`.
#[must_use]
pub fn reference_attitude(reference: &Reference) -> DQuat {
    let up = reference.specific_force().value.as_dvec3().normalize();
    let left = reference.left_world.as_dvec3();
    DQuat::from_mat3(&DMat3::from_cols(left.cross(up), left, up))
}

/// A time in whole microseconds, as the trace rounds it; `time` in (s), not negative.
#[must_use]
pub fn microseconds(time: f64) -> u64 {
    (time * 1e6).round() as u64
}

/// A time in whole nanoseconds; `time` in (s), not negative.
#[must_use]
pub fn nanoseconds(time: f64) -> u64 {
    (time * 1e9).round() as u64
}
