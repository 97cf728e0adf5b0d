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
    /// Bound of the torque about each body axis (8) (N m); `f32::MAX` for a controller without one.
    pub torque_max: Vec3,
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

/// A closed interval per body axis, known to contain an unknown quantity.
///
/// In a file an end that is one number is that of all three axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct VectorInterval {
    /// Smallest possible values.
    #[cfg_attr(feature = "serde", serde(with = "crate::per_axis"))]
    pub lower: Vec3,
    /// Largest possible values.
    #[cfg_attr(feature = "serde", serde(with = "crate::per_axis"))]
    pub upper: Vec3,
}

impl VectorInterval {
    /// `[lower, upper]` about every axis.
    #[must_use]
    pub const fn splat(lower: f32, upper: f32) -> Self {
        Self { lower: Vec3::splat(lower), upper: Vec3::splat(upper) }
    }

    /// The intervals about x, y and z.
    #[must_use]
    pub fn axes(&self) -> [Interval; 3] {
        let of = |lower, upper| Interval { lower, upper };
        let Self { lower, upper } = self;
        [of(lower.x, upper.x), of(lower.y, upper.y), of(lower.z, upper.z)]
    }

    /// Returns `true` if every element lies inside its interval, ends included.
    #[must_use]
    pub fn contains(&self, x: Vec3) -> bool {
        self.lower.cmple(x).all() && x.cmple(self.upper).all()
    }
}

/// Known bounds of the vehicle and of its disturbances (Assumptions 1 to 3).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Uncertainty {
    /// `[m_lo, m_hi]`: the mass lies inside (kg).
    pub mass: Interval,
    /// `[J_lo, J_hi]`: each principal moment of inertia lies inside that of its axis (kg m^2).
    pub inertia: VectorInterval,
    /// `D1`: bound of each component of the disturbance acceleration `d1` (m/s^2).
    pub disturbance_acceleration: f32,
    /// `D2`: bound of the disturbance torque `d2` about each body axis (N m).
    #[cfg_attr(feature = "serde", serde(with = "crate::per_axis"))]
    pub disturbance_torque: Vec3,
}

/// Estimates at the first step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct InitialEstimate {
    /// Mass (kg), inside its interval.
    pub mass: f32,
    /// Principal moments of inertia (kg m^2), each inside the interval of its axis.
    pub inertia: Vec3,
}
