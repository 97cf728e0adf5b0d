//! GNSS receiver: position and velocity of one epoch, late, with dropouts and jumps.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::jump::Jumps;
use super::random::Normal;
use super::schedule::Schedule;
use crate::plant::PlantState;

/// Half of the horizontal positions lie within `1.1774` standard deviations of one axis.
const CEP: f64 = 1.177_41;

/// Parameters of a receiver.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GnssParameters {
    /// Rate of the epochs (Hz).
    pub rate: f64,
    /// Age of a solution when it arrives (s).
    pub delay: f64,
    /// Radius that holds half of the horizontal positions (m).
    pub position_cep: f64,
    /// Standard deviation of the height (m).
    pub height_deviation: f64,
    /// Half of the horizontal velocities are better than this (m/s).
    pub velocity_accuracy: f64,
    /// Standard deviation of the vertical velocity (m/s).
    pub vertical_velocity_deviation: f64,
    /// Share of epochs that are lost.
    pub dropout: f64,
    /// Mean time between two jumps (s); `inf` for none.
    pub jump_interval: f64,
    /// Length of a jump of the position (m).
    pub jump_size: f64,
    /// Time that a jump lasts (s).
    pub jump_duration: f64,
}

impl GnssParameters {
    /// u-blox NEO-M9N. Data sheet: 2.0 m horizontal position (circle that holds half), velocity 0.05 m/s (half of
    /// the values), up to 25 Hz. Height, vertical velocity and delay are assumed: 1.5 times the horizontal
    /// deviations, and 0.1 s. Errors are independent from epoch to epoch here; a receiver's drift is not.
    pub const M9N: Self = Self {
        rate: 10.0,
        delay: 0.1,
        position_cep: 2.0,
        height_deviation: 2.5,
        velocity_accuracy: 0.05,
        vertical_velocity_deviation: 0.06,
        dropout: 0.0,
        jump_interval: f64::INFINITY,
        jump_size: 0.0,
        jump_duration: 1.0,
    };

    /// Standard deviations of the position along each axis (m).
    #[must_use]
    pub fn position_deviation(&self) -> DVec3 {
        let horizontal = self.position_cep / CEP;
        DVec3::new(horizontal, horizontal, self.height_deviation)
    }

    /// Standard deviations of the velocity along each axis (m/s).
    #[must_use]
    pub fn velocity_deviation(&self) -> DVec3 {
        let horizontal = self.velocity_accuracy / CEP;
        DVec3::new(horizontal, horizontal, self.vertical_velocity_deviation)
    }
}

/// Solution of one epoch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// World axes (m).
    pub position: DVec3,
    /// World axes (m/s).
    pub velocity: DVec3,
}

/// A receiver in flight.
#[derive(Clone, Debug)]
pub struct Gnss {
    parameters: GnssParameters,
    schedule: Schedule<Solution>,
    jumps: Jumps,
    normal: Normal,
}

impl Gnss {
    /// Of a flight with `seed`, in ticks of `tick` (s).
    #[must_use]
    pub fn new(parameters: &GnssParameters, seed: u64, tick: f64) -> Self {
        let p = *parameters;
        Self {
            parameters: p,
            schedule: Schedule::new(p.rate, p.delay, p.dropout, tick, Normal::new(seed, 30)),
            jumps: Jumps::new(
                p.jump_interval,
                p.jump_size,
                p.jump_duration,
                1.0 / p.rate,
                Normal::new(seed, 31),
            ),
            normal: Normal::new(seed, 32),
        }
    }

    /// A solution when one arrives.
    pub fn advance(&mut self, tick: u64, truth: &PlantState) -> Option<Solution> {
        let Self { parameters, schedule, jumps, normal } = self;
        schedule.advance(tick, || Solution {
            position: truth.position_world
                + jumps.advance()
                + parameters.position_deviation() * normal.vector(),
            velocity: truth.velocity_world + parameters.velocity_deviation() * normal.vector(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn half_of_the_positions_lie_within_the_circle() {
        let parameters = GnssParameters { rate: 1000.0, ..GnssParameters::M9N };
        let mut gnss = Gnss::new(&parameters, 5, 1e-3);
        let truth = PlantState {
            position_world: DVec3::new(10.0, 20.0, 30.0),
            velocity_world: DVec3::X,
            attitude: DQuat::IDENTITY,
            rate_body: DVec3::ZERO,
        };
        let solutions: Vec<_> = (0..20_000).filter_map(|tick| gnss.advance(tick, &truth)).collect();
        let share = |inside: &dyn Fn(&Solution) -> bool| {
            solutions.iter().filter(|s| inside(s)).count() as f64 / solutions.len() as f64
        };
        let position = |s: &Solution| (s.position - truth.position_world).truncate().length() < 2.0;
        let velocity = |s: &Solution| (s.velocity - DVec3::X).truncate().length() < 0.05;
        assert!((share(&position) - 0.5).abs() < 0.012, "{}", share(&position));
        assert!((share(&velocity) - 0.5).abs() < 0.012);
    }
}
