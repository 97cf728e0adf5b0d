//! A horizontal figure of eight (Gerono's lemniscate).
//!
//! ```text
//! p_d = centre + (A sin(w t), B sin(2 w t), 0)
//! ```

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::harmonic::{Harmonic, Rotation};
use super::{
    REACH, Trajectory, from_coordinates, horizontal, require_flyable, require_position,
    require_step_period, require_yaw, resting,
};
use crate::error::{Bound, ConfigError, require};
use crate::jet::Jet;
use crate::reference::Reference;

/// Shape of the figure of eight.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct LemniscateConfig {
    /// Crossing point (m); its third coordinate is the constant height.
    pub centre_world: Vec3,
    /// `A`: largest excursion along world x (m), not negative.
    pub amplitude_x: f32,
    /// `B`: largest excursion along world y (m), not negative.
    pub amplitude_y: f32,
    /// `w`: angular rate of a whole figure (rad/s).
    pub angular_rate: f32,
    /// Angle of body x from world x about world z (rad), within a turn.
    pub yaw: f32,
}

/// The figure of eight, validated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lemniscate {
    centre_world: Vec3,
    along_x: Harmonic,
    along_y: Harmonic,
    rotation: Rotation,
    forward_world: Vec3,
    step_period: f32,
}

impl Lemniscate {
    /// Flies `config`, sampled every `step_period` (s).
    ///
    /// # Errors
    /// Names the field that is out of its range, the step period, or the product of amplitude and
    /// squared angular rate that exceeds `g`.
    pub fn new(config: &LemniscateConfig, step_period: f32) -> Result<Self, ConfigError> {
        let LemniscateConfig { centre_world, amplitude_x, amplitude_y, angular_rate, yaw } =
            *config;
        require_step_period(step_period)?;
        require_position("lemniscate.centre_world", centre_world)?;
        let extent = Bound::Inside(0.0, REACH);
        require("lemniscate.amplitude_x", amplitude_x, extent, "reach of f32")?;
        require("lemniscate.amplitude_y", amplitude_y, extent, "reach of f32")?;
        let rotation = Rotation::new("lemniscate.angular_rate", angular_rate, step_period)?;
        require_yaw("lemniscate.yaw", yaw)?;
        let along_x = Harmonic::new(amplitude_x, angular_rate);
        let along_y = Harmonic::new(amplitude_y, 2.0 * angular_rate);
        require_flyable("lemniscate.amplitude_x * angular_rate^2", along_x.acceleration())?;
        require_flyable("4 * lemniscate.amplitude_y * angular_rate^2", along_y.acceleration())?;
        let forward_world = horizontal(yaw);
        Ok(Self { centre_world, along_x, along_y, rotation, forward_world, step_period })
    }
}

impl Trajectory for Lemniscate {
    fn reference(&self, tick: u64) -> Reference {
        let along_x = self.along_x.sine(self.rotation.at(tick));
        let along_y = self.along_y.sine(self.rotation.doubled().at(tick));
        from_coordinates(self.centre_world, [along_x, along_y, resting(0.0)])
            .facing(Jet::constant(self.forward_world))
    }

    fn acceleration_bound(&self) -> f32 {
        self.along_x.acceleration().max(self.along_y.acceleration())
    }

    fn step_period(&self) -> f32 {
        self.step_period
    }
}

#[cfg(test)]
mod tests {
    use super::super::closed_form::{assert_bound, assert_follows, facing};
    use super::*;

    const EIGHT: LemniscateConfig = LemniscateConfig {
        centre_world: Vec3::new(0.0, 1.0, 2.0),
        amplitude_x: 4.0,
        amplitude_y: 1.5,
        angular_rate: 0.75,
        yaw: 0.4,
    };

    #[test]
    fn is_the_closed_form() {
        let (w, yaw) = (0.75, f64::from(EIGHT.yaw));
        assert_follows(
            &Lemniscate::new(&EIGHT, 1e-3).unwrap(),
            10.0,
            0.5 / w,
            |t| [4.0 * (w * t).sin(), 1.0 + 1.5 * (2.0 * w * t).sin(), 2.0],
            |t| {
                let x = -4.0 * w * w * (w * t).sin();
                let y = -6.0 * w * w * (2.0 * w * t).sin();
                facing([x, y, 0.0], [yaw.cos(), yaw.sin(), 0.0])
            },
        );
    }

    #[test]
    fn bound_is_kept_and_attained() {
        let eight = Lemniscate::new(&EIGHT, 1e-3).unwrap();
        assert_eq!(eight.acceleration_bound(), 3.375);
        assert_bound(&eight, 9_000, 0.9999);
        let long = LemniscateConfig { amplitude_x: 12.0, ..EIGHT };
        assert_bound(&Lemniscate::new(&long, 1e-3).unwrap(), 9_000, 0.9999);
    }

    #[test]
    fn refuses_each_field_out_of_range() {
        let refused = |config| Lemniscate::new(&config, 1e-3).unwrap_err().parameter;
        let bad = LemniscateConfig { centre_world: Vec3::splat(2e5), ..EIGHT };
        assert_eq!(refused(bad), "lemniscate.centre_world");
        assert_eq!(
            refused(LemniscateConfig { amplitude_x: -1.0, ..EIGHT }),
            "lemniscate.amplitude_x"
        );
        let bad = LemniscateConfig { amplitude_y: f32::NAN, ..EIGHT };
        assert_eq!(refused(bad), "lemniscate.amplitude_y");
        let bad = LemniscateConfig { angular_rate: 600.0, ..EIGHT };
        assert_eq!(refused(bad), "lemniscate.angular_rate");
        assert_eq!(refused(LemniscateConfig { yaw: -7.0, ..EIGHT }), "lemniscate.yaw");
        let bad = LemniscateConfig { amplitude_x: 20.0, ..EIGHT };
        assert_eq!(refused(bad), "lemniscate.amplitude_x * angular_rate^2");
        let bad = LemniscateConfig { amplitude_y: 5.0, ..EIGHT };
        assert_eq!(refused(bad), "4 * lemniscate.amplitude_y * angular_rate^2");
        assert_eq!(Lemniscate::new(&EIGHT, -1e-3).unwrap_err().parameter, "step_period");
    }
}
