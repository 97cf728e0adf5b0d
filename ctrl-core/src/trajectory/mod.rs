//! Reference trajectories with analytic derivatives up to snap.
//!
//! A trajectory is evaluated at an integer tick, so that time never accumulates rounding; each
//! one is immutable, bounded in storage, and knows a bound of its own acceleration.
//!
//! [`TrajectoryConfig`] is what a scenario file or a message selects one with, and
//! [`AnyTrajectory`] what it builds.

use glam::Vec3;

use crate::error::{Bound, ConfigError, require};
use crate::reference::Reference;
use crate::trigonometry::sin_cos;
use crate::vehicle::GRAVITY;

mod any;
mod circle;
#[cfg(test)]
mod closed_form;
mod harmonic;
mod hover;
mod lemniscate;
mod rising_circle;
mod waypoint_path;

pub use any::{AnyTrajectory, CheckedTrajectory, TrajectoryConfig};
pub use circle::{Circle, CircleConfig, Heading};
pub use hover::{Hover, HoverConfig};
pub use lemniscate::{Lemniscate, LemniscateConfig};
pub use rising_circle::{RisingCircle, RisingCircleConfig};
pub use waypoint_path::{CheckedPath, Leg, MAX_LEGS, WaypointPath, WaypointPathConfig};

/// Largest coordinate or extent of a trajectory (m); f32 resolves it to 8 mm.
pub const REACH: f32 = 1e5;

/// A reference for every tick.
pub trait Trajectory {
    /// The reference at `tick` steps after the start.
    fn reference(&self, tick: u64) -> Reference;

    /// A bound of the magnitude of each component of the acceleration, over all time (m/s^2).
    fn acceleration_bound(&self) -> f32;

    /// The time between two ticks (s).
    fn step_period(&self) -> f32;
}

/// A coordinate with its first four time derivatives, in SI units.
type Coordinate = [f32; 5];

/// A coordinate that does not change.
const fn resting(position: f32) -> Coordinate {
    [position, 0.0, 0.0, 0.0, 0.0]
}

/// Puts the reference together from its coordinates, each relative to `origin_world` (m); the
/// heading is left to the caller.
fn from_coordinates(origin_world: Vec3, [x, y, z]: [Coordinate; 3]) -> Reference {
    let ([x0, x1, x2, x3, x4], [y0, y1, y2, y3, y4], [z0, z1, z2, z3, z4]) = (x, y, z);
    Reference {
        velocity_world: Vec3::new(x1, y1, z1),
        acceleration_world: Vec3::new(x2, y2, z2),
        jerk_world: Vec3::new(x3, y3, z3),
        snap_world: Vec3::new(x4, y4, z4),
        ..Reference::hover(origin_world + Vec3::new(x0, y0, z0))
    }
}

/// The unit vector in the horizontal plane at the angle `yaw` (rad) from world x.
fn horizontal(yaw: f32) -> Vec3 {
    let (sin, cos) = sin_cos(yaw);
    Vec3::new(cos, sin, 0.0)
}

/// Refuses a step period outside 10 Hz to 10 kHz.
fn require_step_period(step_period: f32) -> Result<(), ConfigError> {
    require("step_period", step_period, Bound::Inside(1e-4, 0.1), "10 Hz to 10 kHz")
}

/// Refuses an acceleration that no controller accepts: (19) needs `M_p < g`, and the thrust
/// direction and with it the heading need `|p_d''_z| < g`.
fn require_flyable(parameter: &'static str, acceleration: f32) -> Result<(), ConfigError> {
    require(parameter, acceleration, Bound::Below(GRAVITY), "thrust stays positive (19)")
}

/// Refuses a position with a coordinate that is not finite or beyond [`REACH`].
fn require_position(parameter: &'static str, position: Vec3) -> Result<(), ConfigError> {
    position.to_array().into_iter().try_for_each(|coordinate| {
        require(parameter, coordinate, Bound::Inside(-REACH, REACH), "reach of f32")
    })
}

/// Refuses an angle that is not finite or beyond a turn either way (rad).
fn require_yaw(parameter: &'static str, yaw: f32) -> Result<(), ConfigError> {
    use core::f32::consts::TAU;
    require(parameter, yaw, Bound::Inside(-TAU, TAU), "at most one turn")
}
