//! Motion capture: position and attitude from outside, late, with dropouts and jumps.

use crate::norm::rotation_about;
use core::f64::consts::PI;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::jump::Jumps;
use super::random::Normal;
use super::schedule::Schedule;
use crate::plant::PlantState;

/// Parameters of a motion-capture system.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaptureParameters {
    /// Rate of the poses (Hz).
    pub rate: f64,
    /// Age of a pose when it arrives (s).
    pub delay: f64,
    /// Standard deviation of the position along each axis (mm).
    pub position_deviation: f64,
    /// Standard deviation of the attitude about each axis (deg).
    pub attitude_deviation: f64,
    /// Share of poses that are lost.
    pub dropout: f64,
    /// Mean time between two jumps, as of a body that is taken for another (s); `inf` for none.
    pub jump_interval: f64,
    /// Length of a jump of the position (m).
    pub jump_size: f64,
    /// Time that a jump lasts (s).
    pub jump_duration: f64,
}

impl CaptureParameters {
    /// A system like Vicon's. Its maker names accuracies below a millimetre, rates above 100 Hz and latencies of a
    /// few milliseconds, which the network adds to; for a body of 0.2 m the position's error is 0.3 degree.
    pub const VICON: Self = Self {
        rate: 100.0,
        delay: 0.01,
        position_deviation: 1.0,
        attitude_deviation: 0.3,
        dropout: 0.0,
        jump_interval: f64::INFINITY,
        jump_size: 0.0,
        jump_duration: 1.0,
    };

    /// Standard deviations: position (m), attitude (rad).
    #[must_use]
    pub fn deviations(&self) -> (f64, f64) {
        (self.position_deviation * 1e-3, self.attitude_deviation * PI / 180.0)
    }
}

/// One pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// World axes (m).
    pub position: DVec3,
    /// Body to world.
    pub attitude: DQuat,
}

/// A system in operation.
#[derive(Clone, Debug)]
pub struct Capture {
    parameters: CaptureParameters,
    schedule: Schedule<Pose>,
    jumps: Jumps,
    normal: Normal,
}

impl Capture {
    /// Of a flight with `seed`, in ticks of `tick` (s).
    #[must_use]
    pub fn new(parameters: &CaptureParameters, seed: u64, tick: f64) -> Self {
        let p = *parameters;
        Self {
            parameters: p,
            schedule: Schedule::new(p.rate, p.delay, p.dropout, tick, Normal::new(seed, 40)),
            jumps: Jumps::new(
                p.jump_interval,
                p.jump_size,
                p.jump_duration,
                1.0 / p.rate,
                Normal::new(seed, 41),
            ),
            normal: Normal::new(seed, 42),
        }
    }

    /// A pose when one arrives.
    pub fn advance(&mut self, tick: u64, truth: &PlantState) -> Option<Pose> {
        let Self { parameters, schedule, jumps, normal } = self;
        let (position, attitude) = parameters.deviations();
        schedule.advance(tick, || Pose {
            position: truth.position_world + jumps.advance() + position * normal.vector(),
            attitude: rotation_about(attitude * normal.vector()) * truth.attitude,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_scatter_by_their_deviations_about_the_pose_of_their_time() {
        let mut capture = Capture::new(&CaptureParameters::VICON, 3, 1e-3);
        let at = |tick: u64| PlantState {
            position_world: DVec3::X * 1e-3 * tick as f64,
            velocity_world: DVec3::X,
            attitude: DQuat::from_rotation_z(1e-3 * tick as f64),
            rate_body: DVec3::Z,
        };
        let (mut position, mut attitude, mut n) = (0.0, 0.0, 0.0);
        for tick in 0..300_000 {
            if let Some(pose) = capture.advance(tick, &at(tick)) {
                let then = at(tick - 10);
                position += (pose.position - then.position_world).length_squared() / 3.0;
                let turn = pose.attitude * then.attitude.inverse();
                attitude += 4.0 * (turn.x * turn.x + turn.y * turn.y + turn.z * turn.z) / 3.0;
                n += 1.0;
            }
        }
        let (p, a) = CaptureParameters::VICON.deviations();
        assert!((libm::sqrt(position / n) / p - 1.0).abs() < 0.02);
        assert!((libm::sqrt(attitude / n) / a - 1.0).abs() < 0.02);
        assert_eq!(n, 29_999.0);
    }
}
