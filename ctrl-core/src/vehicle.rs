//! Quantities exchanged between vehicle and controller, and known bounds of the vehicle.
//!
//! Frames and rotations follow [`crate::rotation`]; all units are SI.

use glam::{Quat, Vec3};
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

/// Gravitational acceleration `g` of the paper (m/s^2), rounded from the standard 9.80665; gravity is `-g e3`.
pub const GRAVITY: f32 = 9.81;

/// Position, velocity, attitude and body rate of the vehicle at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[repr(C)] // the C interface uses it in place
pub struct VehicleState {
    /// `p`: position of the centre of mass in the world frame (m).
    pub position_world: Vec3,
    /// `v`: velocity of the centre of mass in the world frame (m/s).
    pub velocity_world: Vec3,
    /// `q`: unit quaternion that takes body to world coordinates.
    pub attitude: Quat,
    /// `w`: angular velocity in body axes (rad/s).
    pub rate_body: Vec3,
}

impl VehicleState {
    /// At rest in `position_world` (m), level, body axes along the world's.
    #[must_use]
    pub const fn at_rest(position_world: Vec3) -> Self {
        Self {
            position_world,
            velocity_world: Vec3::ZERO,
            attitude: Quat::IDENTITY,
            rate_body: Vec3::ZERO,
        }
    }
}

/// Command to the rotors: collective thrust and torque.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct Wrench {
    /// `f`: collective thrust along body +z (N), never negative.
    pub thrust: f32,
    /// `tau`: torque in body axes (N m).
    pub torque_body: Vec3,
}

/// The set in which every [`Wrench`] of a controller lies.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
pub struct WrenchBounds {
    /// Lower thrust bound (19) (N), positive.
    pub thrust_min: f32,
    /// Upper thrust bound (20) (N).
    pub thrust_max: f32,
    /// Bound of each torque component (8) (N m); `f32::MAX` for a controller without one.
    pub torque_max: f32,
}

/// A closed interval `[lower, upper]` known to contain an unknown quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Interval {
    /// Smallest possible value.
    pub lower: f32,
    /// Largest possible value.
    pub upper: f32,
}

impl Interval {
    /// Returns `true` if `x` lies inside, ends included.
    #[must_use]
    pub fn contains(&self, x: f32) -> bool {
        self.lower <= x && x <= self.upper
    }
}

/// Known bounds of the vehicle and of its disturbances (Assumptions 1 to 3).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Uncertainty {
    /// `[m_lo, m_hi]`: the mass lies inside (kg).
    pub mass: Interval,
    /// `[J_lo, J_hi]`: each principal moment of inertia lies inside (kg m^2).
    pub inertia: Interval,
    /// `D1`: bound of each component of the disturbance acceleration `d1` (m/s^2).
    pub disturbance_acceleration: f32,
    /// `D2`: bound of each component of the disturbance torque `d2` (N m).
    pub disturbance_torque: f32,
}

/// Estimates at the first step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct InitialEstimate {
    /// Mass (kg), inside its interval.
    pub mass: f32,
    /// Principal moments of inertia (kg m^2), each inside its interval.
    pub inertia: Vec3,
}
