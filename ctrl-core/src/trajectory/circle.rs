//! A horizontal circle at constant speed.
//!
//! ```text
//! p_d = centre + (R cos(w t), R sin(w t), 0)
//! ```

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::harmonic::{Harmonic, Phasor, Rotation};
use super::{
    REACH, Trajectory, from_coordinates, horizontal, require_flyable, require_position,
    require_step_period, require_yaw, resting,
};
use crate::error::{Bound, ConfigError, require};
use crate::jet::Jet;
use crate::reference::Reference;

/// Heading of body x on a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Heading {
    /// Along the velocity.
    Tangent,
    /// At this angle from world x about world z (rad), within a turn.
    Yaw(f32),
}

/// Shape of the circle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct CircleConfig {
    /// Centre (m); its third coordinate is the constant height.
    pub centre_world: Vec3,
    /// `R`: radius (m), not negative.
    pub radius: f32,
    /// `w`: angular rate (rad/s), positive anticlockwise.
    pub angular_rate: f32,
    /// Heading of body x.
    pub heading: Heading,
}

/// The circle, validated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    centre_world: Vec3,
    circle: Harmonic,
    rotation: Rotation,
    angular_rate: f32,
    /// The fixed direction of body x, unless it follows the tangent.
    forward_world: Option<Vec3>,
    step_period: f32,
}

impl Circle {
    /// Flies `config`, sampled every `step_period` (s).
    ///
    /// # Errors
    /// Names the field that is out of its range, the step period, or the product of radius and
    /// squared angular rate that exceeds `g`.
    pub fn new(config: &CircleConfig, step_period: f32) -> Result<Self, ConfigError> {
        let CircleConfig { centre_world, radius, angular_rate, heading } = *config;
        require_step_period(step_period)?;
        require_position("circle.centre_world", centre_world)?;
        require("circle.radius", radius, Bound::Inside(0.0, REACH), "reach of f32")?;
        let rotation = Rotation::new("circle.angular_rate", angular_rate, step_period)?;
        let circle = Harmonic::new(radius, angular_rate);
        require_flyable("circle.radius * angular_rate^2", circle.acceleration())?;
        let forward_world = match heading {
            Heading::Tangent => None,
            Heading::Yaw(yaw) => {
                require_yaw("circle.heading.yaw", yaw)?;
                Some(horizontal(yaw))
            }
        };
        Ok(Self { centre_world, circle, rotation, angular_rate, forward_world, step_period })
    }

    /// The unit vector along the velocity, with its derivatives.
    fn tangent(&self, Phasor { cos, sin }: Phasor) -> Jet<Vec3> {
        let w = self.angular_rate;
        let tangent = Vec3::new(-sin, cos, 0.0) * w.signum();
        Jet::new(tangent, -w.abs() * Vec3::new(cos, sin, 0.0), -w * w * tangent)
    }
}

impl Trajectory for Circle {
    fn reference(&self, tick: u64) -> Reference {
        let phasor = self.rotation.at(tick);
        let position = [self.circle.cosine(phasor), self.circle.sine(phasor), resting(0.0)];
        let forward = match self.forward_world {
            Some(fixed) => Jet::constant(fixed),
            None => self.tangent(phasor),
        };
        from_coordinates(self.centre_world, position).facing(forward)
    }

    fn acceleration_bound(&self) -> f32 {
        self.circle.acceleration()
    }

    fn step_period(&self) -> f32 {
        self.step_period
    }
}

#[cfg(test)]
mod tests {
    use super::super::closed_form::{assert_bound, assert_follows, facing};
    use super::*;

    const CIRCLE: CircleConfig = CircleConfig {
        centre_world: Vec3::new(3.0, -4.0, 5.0),
        radius: 2.0,
        angular_rate: 1.5,
        heading: Heading::Tangent,
    };

    fn follows_the_closed_form(config: CircleConfig, forward: impl Fn(f64) -> [f64; 3]) {
        let w = f64::from(config.angular_rate);
        assert_follows(
            &Circle::new(&config, 2e-3).unwrap(),
            10.0,
            1.0 / w.abs(),
            |t| [3.0 + 2.0 * (w * t).cos(), -4.0 + 2.0 * (w * t).sin(), 5.0],
            |t| {
                let pull = -2.0 * w * w;
                facing([pull * (w * t).cos(), pull * (w * t).sin(), 0.0], forward(t))
            },
        );
    }

    #[test]
    fn is_the_closed_form_along_the_tangent_either_way_round() {
        follows_the_closed_form(CIRCLE, |t| [-(1.5 * t).sin(), (1.5 * t).cos(), 0.0]);
        let back = CircleConfig { angular_rate: -1.5, ..CIRCLE };
        follows_the_closed_form(back, |t| [-(1.5 * t).sin(), -(1.5 * t).cos(), 0.0]);
    }

    #[test]
    fn is_the_closed_form_at_a_fixed_yaw() {
        let yaw = f64::from(-0.8f32);
        let config = CircleConfig { heading: Heading::Yaw(-0.8), ..CIRCLE };
        follows_the_closed_form(config, |_| [yaw.cos(), yaw.sin(), 0.0]);
    }

    #[test]
    fn bound_is_kept_and_attained() {
        let circle = Circle::new(&CIRCLE, 2e-3).unwrap();
        assert_eq!(circle.acceleration_bound(), 4.5);
        assert_bound(&circle, 10_000, 0.9999);
    }

    #[test]
    fn refuses_each_field_out_of_range() {
        let refused = |config| Circle::new(&config, 2e-3).unwrap_err().parameter;
        let bad = CircleConfig { centre_world: Vec3::NAN, ..CIRCLE };
        assert_eq!(refused(bad), "circle.centre_world");
        assert_eq!(refused(CircleConfig { radius: -0.1, ..CIRCLE }), "circle.radius");
        assert_eq!(refused(CircleConfig { angular_rate: -251.0, ..CIRCLE }), "circle.angular_rate");
        let bad = CircleConfig { angular_rate: 3.0, ..CIRCLE };
        assert_eq!(refused(bad), "circle.radius * angular_rate^2");
        let bad = CircleConfig { heading: Heading::Yaw(7.0), ..CIRCLE };
        assert_eq!(refused(bad), "circle.heading.yaw");
        assert_eq!(Circle::new(&CIRCLE, 1.0).unwrap_err().parameter, "step_period");
    }
}
