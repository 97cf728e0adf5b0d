//! The paper's trajectory: a circle about the world's z axis that rises to a height.
//!
//! ```text
//! p_d = (R cos(w t), R sin(w t), h - h exp(-l t))
//! b2d = (sin(w t), -cos(w t), 0): body x points to the axis
//! ```
//!
//! `b2d . (p_d'' + g e3) = 0` at every instant (Assumption 5, corrected).

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::harmonic::{Harmonic, Rotation};
use super::{
    Coordinate, REACH, Trajectory, from_coordinates, require_flyable, require_step_period,
};
use crate::error::{Bound, ConfigError, require};
use crate::reference::Reference;

/// Shape of the rising circle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct RisingCircleConfig {
    /// `R`: radius (m), not negative.
    pub radius: f32,
    /// `w`: angular rate (rad/s), positive anticlockwise.
    pub angular_rate: f32,
    /// `h`: height that is approached (m).
    pub height: f32,
    /// `l`: rate of rise (1/s), not negative; after `1/l` 63 % of the height is reached.
    pub rise_rate: f32,
}

/// The rising circle, validated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RisingCircle {
    circle: Harmonic,
    rotation: Rotation,
    angular_rate: f32,
    /// `h l^k`: the height and the largest of each of its derivatives (m/s^k).
    rise: Harmonic,
    /// `l dt`: decay of the remaining rise in one step.
    decay_per_tick: f32,
    step_period: f32,
}

impl RisingCircle {
    /// Flies `config`, sampled every `step_period` (s).
    ///
    /// # Errors
    /// Names the field that is out of its range, the step period, or the product of radius and
    /// squared angular rate (or height and squared rate of rise) that exceeds `g`.
    pub fn new(config: &RisingCircleConfig, step_period: f32) -> Result<Self, ConfigError> {
        let RisingCircleConfig { radius, angular_rate, height, rise_rate } = *config;
        require_step_period(step_period)?;
        require("rising_circle.radius", radius, Bound::Inside(0.0, REACH), "reach of f32")?;
        let rotation = Rotation::new("rising_circle.angular_rate", angular_rate, step_period)?;
        require("rising_circle.height", height, Bound::Inside(-REACH, REACH), "reach of f32")?;
        let fastest = Bound::Inside(0.0, 0.5 / step_period);
        require("rising_circle.rise_rate", rise_rate, fastest, "resolved by the step")?;
        let circle = Harmonic::new(radius, angular_rate);
        let rise = Harmonic::new(height, rise_rate);
        require_flyable("rising_circle.radius * angular_rate^2", circle.acceleration())?;
        require_flyable("rising_circle.height * rise_rate^2", rise.acceleration())?;
        let decay_per_tick = (f64::from(rise_rate) * f64::from(step_period)) as f32;
        Ok(Self { circle, rotation, angular_rate, rise, decay_per_tick, step_period })
    }
}

impl Trajectory for RisingCircle {
    fn reference(&self, tick: u64) -> Reference {
        let phasor = self.rotation.at(tick);
        let rise = self.rise.approach(libm::expf(-self.decay_per_tick * tick as f32));
        let position = [self.circle.cosine(phasor), self.circle.sine(phasor), rise];
        let left_world = Vec3::new(phasor.sin, -phasor.cos, 0.0);
        let w = self.angular_rate;
        Reference {
            left_world,
            left_rate_world: w * Vec3::new(phasor.cos, phasor.sin, 0.0),
            left_acceleration_world: -w * w * left_world,
            ..from_coordinates(Vec3::ZERO, position)
        }
    }

    fn acceleration_bound(&self) -> f32 {
        self.circle.acceleration().max(self.rise.acceleration())
    }

    fn step_period(&self) -> f32 {
        self.step_period
    }
}

impl Harmonic {
    /// `A - A x` with its derivatives, where `x = exp(-w t)`.
    fn approach(&self, x: f32) -> Coordinate {
        let [a0, a1, a2, a3, a4] = self.amplitudes();
        [a0 - a0 * x, a1 * x, -a2 * x, a3 * x, -a4 * x]
    }
}

#[cfg(test)]
mod tests {
    use super::super::closed_form::{assert_bound, assert_follows, at};
    use super::*;

    /// `docs/theory.md`, "The paper's example".
    const PAPER: RisingCircleConfig =
        RisingCircleConfig { radius: 100.0, angular_rate: 0.05, height: 10.0, rise_rate: 0.1 };

    #[test]
    fn is_the_closed_form() {
        for angular_rate in [0.05, -0.05, 0.11] {
            let config = RisingCircleConfig { angular_rate, ..PAPER };
            let (w, l) = (f64::from(angular_rate), f64::from(config.rise_rate));
            assert_follows(
                &RisingCircle::new(&config, 1e-3).unwrap(),
                400.0,
                9.0,
                |t| [100.0 * (w * t).cos(), 100.0 * (w * t).sin(), 10.0 - 10.0 * (-l * t).exp()],
                |t| [(w * t).sin(), -(w * t).cos(), 0.0],
            );
        }
    }

    #[test]
    fn bound_is_that_of_the_paper_and_attained() {
        let trajectory = RisingCircle::new(&PAPER, 1e-3).unwrap();
        assert_eq!(trajectory.acceleration_bound(), 0.25);
        assert_bound(&trajectory, 130_000, 0.9999);
        let steep = RisingCircleConfig { radius: 1.0, rise_rate: 0.9, ..PAPER };
        assert_bound(&RisingCircle::new(&steep, 1e-3).unwrap(), 5_000, 0.9999);
    }

    #[test]
    fn a_billion_ticks_later_it_is_still_on_the_circle() {
        let trajectory = RisingCircle::new(&PAPER, 1e-3).unwrap();
        let t = at(&trajectory, 1_000_000_000);
        let angle = f64::from(0.05f32) * t;
        let reference = trajectory.reference(1_000_000_000);
        let exact = Vec3::new((100.0 * angle.cos()) as f32, (100.0 * angle.sin()) as f32, 10.0);
        assert!((reference.position_world - exact).length() < 2e-5, "{reference:?}");
    }

    #[test]
    fn refuses_each_field_out_of_range() {
        let refused =
            |config, step_period| RisingCircle::new(&config, step_period).unwrap_err().parameter;
        let bad = RisingCircleConfig { radius: -1.0, ..PAPER };
        assert_eq!(refused(bad, 1e-3), "rising_circle.radius");
        let bad = RisingCircleConfig { angular_rate: 501.0, ..PAPER };
        assert_eq!(refused(bad, 1e-3), "rising_circle.angular_rate");
        let bad = RisingCircleConfig { height: f32::NAN, ..PAPER };
        assert_eq!(refused(bad, 1e-3), "rising_circle.height");
        let bad = RisingCircleConfig { rise_rate: -0.1, ..PAPER };
        assert_eq!(refused(bad, 1e-3), "rising_circle.rise_rate");
        let bad = RisingCircleConfig { angular_rate: 0.4, ..PAPER };
        assert_eq!(refused(bad, 1e-3), "rising_circle.radius * angular_rate^2");
        let bad = RisingCircleConfig { rise_rate: 1.0, ..PAPER };
        assert_eq!(refused(bad, 1e-3), "rising_circle.height * rise_rate^2");
        assert_eq!(refused(PAPER, f32::NAN), "step_period");
    }
}
