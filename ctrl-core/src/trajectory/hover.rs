//! Standing still: `p_d` and the heading are constant, every derivative is zero.

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use super::{Trajectory, horizontal, require_position, require_step_period, require_yaw};
use crate::error::ConfigError;
use crate::jet::Jet;
use crate::reference::Reference;

/// Position and heading of a hover.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct HoverConfig {
    /// `p_d`: position (m), each coordinate within [`REACH`](super::REACH).
    pub position_world: Vec3,
    /// Angle of body x from world x about world z (rad), within a turn.
    pub yaw: f32,
}

/// A fixed position and heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hover {
    reference: Reference,
    step_period: f32,
}

impl Hover {
    /// Hovers as `config` says, sampled every `step_period` (s).
    ///
    /// # Errors
    /// Names a field that is not finite or out of its range, or the step period.
    pub fn new(config: &HoverConfig, step_period: f32) -> Result<Self, ConfigError> {
        require_step_period(step_period)?;
        require_position("hover.position_world", config.position_world)?;
        require_yaw("hover.yaw", config.yaw)?;
        let forward = Jet::constant(horizontal(config.yaw));
        Ok(Self { reference: Reference::hover(config.position_world).facing(forward), step_period })
    }
}

impl Trajectory for Hover {
    fn reference(&self, _tick: u64) -> Reference {
        self.reference
    }

    fn acceleration_bound(&self) -> f32 {
        0.0
    }

    fn step_period(&self) -> f32 {
        self.step_period
    }
}

#[cfg(test)]
mod tests {
    use super::super::closed_form::{assert_bound, assert_follows, facing};
    use super::*;

    #[test]
    fn is_the_closed_form() {
        let config = HoverConfig { position_world: Vec3::new(1.0, -2.0, 3.0), yaw: 0.7 };
        let hover = Hover::new(&config, 1e-3).unwrap();
        let yaw = f64::from(config.yaw);
        assert_follows(
            &hover,
            1.0,
            1.0,
            |_| [1.0, -2.0, 3.0],
            |_| facing([0.0; 3], [yaw.cos(), yaw.sin(), 0.0]),
        );
        assert_eq!(hover.acceleration_bound(), 0.0);
        assert_bound(&hover, 100, 0.0);
    }

    #[test]
    fn refuses_what_it_cannot_hold() {
        let good = HoverConfig { position_world: Vec3::ZERO, yaw: 0.0 };
        let far = HoverConfig { position_world: Vec3::new(0.0, 2e5, 0.0), ..good };
        let error = Hover::new(&far, 1e-3).unwrap_err();
        assert_eq!((error.parameter, error.value), ("hover.position_world", 2e5));
        let spun = HoverConfig { yaw: f32::INFINITY, ..good };
        assert_eq!(Hover::new(&spun, 1e-3).unwrap_err().parameter, "hover.yaw");
        assert_eq!(Hover::new(&good, 0.0).unwrap_err().parameter, "step_period");
    }
}
