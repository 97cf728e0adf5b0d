//! What a page shows of one instant of a flight.

use glam::{DQuat, DVec3};

use sim::guarantee::tracking::{rotation_angle, tilt_error};
use sim::tick::Tick;

/// One instant of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Time since the start (s).
    pub time: f64,
    /// Position of the vehicle in the world frame (m).
    pub position_world: DVec3,
    /// Unit quaternion that takes body to world coordinates.
    pub attitude: DQuat,
    /// Position of the reference in the world frame (m).
    pub reference_world: DVec3,
    /// Commanded thrust (N).
    pub thrust: f64,
    /// Angle between body z and the thrust direction that the reference needs (rad).
    pub tilt_error: f64,
}

impl Frame {
    /// What of `tick` a page shows.
    #[must_use]
    pub fn of(tick: &Tick) -> Self {
        Self {
            time: tick.time,
            position_world: tick.truth.position_world,
            attitude: tick.truth.attitude,
            reference_world: tick.reference.position_world.as_dvec3(),
            thrust: f64::from(tick.output.wrench.thrust),
            tilt_error: tilt_error(tick.truth.attitude, &tick.reference),
        }
    }

    /// Distance between vehicle and reference (m).
    #[must_use]
    pub fn position_error(&self) -> f64 {
        self.position_world.distance(self.reference_world)
    }

    /// How far apart two frames are, in steps that the eye can still follow when it is drawn a
    /// straight line between them: of time, of attitude, of thrust.
    pub(super) fn distance(&self, other: &Self, step: &Step) -> f64 {
        let turned = rotation_angle(self.attitude.conjugate() * other.attitude);
        (self.time - other.time).abs() / step.time
            + turned / step.angle
            + (self.thrust - other.thrust).abs() / step.thrust
    }
}

/// What counts as one step between frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// (s)
    pub time: f64,
    /// (rad)
    pub angle: f64,
    /// (N)
    pub thrust: f64,
}
