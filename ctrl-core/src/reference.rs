//! The reference: where to be and which way to face, with every derivative that the laws need.
//!
//! The cascade differentiates the force command twice, so position comes with derivatives up to
//! the fourth and the heading with two. `b2` is the desired direction of body y (left) and must be
//! orthogonal to the desired thrust direction (Assumption 5, corrected):
//!
//! ```text
//! b3d = (p_d'' + g e3)/|p_d'' + g e3|,   b2d . b3d = 0
//! ```

use glam::Vec3;
#[cfg(feature = "serde")]
use serde::{Deserialize, Serialize};

use crate::jet::Jet;
use crate::vehicle::GRAVITY;

/// Desired motion at one tick, in the world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(Serialize, Deserialize))]
#[repr(C)] // the C interface uses it in place
pub struct Reference {
    /// `p_d`: position (m).
    pub position_world: Vec3,
    /// `p_d'`: velocity (m/s).
    pub velocity_world: Vec3,
    /// `p_d''`: acceleration (m/s^2), each component at most `M_p`.
    pub acceleration_world: Vec3,
    /// `p_d'''`: jerk (m/s^3).
    pub jerk_world: Vec3,
    /// `p_d''''`: snap (m/s^4).
    pub snap_world: Vec3,
    /// `b2d`: unit vector along the desired body y (left), orthogonal to `p_d'' + g e3`.
    pub left_world: Vec3,
    /// `b2d'` (1/s).
    pub left_rate_world: Vec3,
    /// `b2d''` (1/s^2).
    pub left_acceleration_world: Vec3,
}

impl Reference {
    /// At rest in `position_world` (m), body x along world x.
    #[must_use]
    pub const fn hover(position_world: Vec3) -> Self {
        Self {
            position_world,
            velocity_world: Vec3::ZERO,
            acceleration_world: Vec3::ZERO,
            jerk_world: Vec3::ZERO,
            snap_world: Vec3::ZERO,
            left_world: Vec3::Y,
            left_rate_world: Vec3::ZERO,
            left_acceleration_world: Vec3::ZERO,
        }
    }

    /// Sets the heading so that body x keeps as close to `forward` (a unit vector in the
    /// horizontal plane with its derivatives) as the thrust direction allows:
    /// `b2d = unit((p_d'' + g e3) × forward)`, orthogonal to `b3d` by construction.
    ///
    /// The two are never parallel while `|p_d''_z| < g`.
    #[must_use]
    pub fn facing(self, forward: Jet<Vec3>) -> Self {
        let left = self.specific_force().cross(forward).unit();
        Self {
            left_world: left.value,
            left_rate_world: left.first,
            left_acceleration_world: left.second,
            ..self
        }
    }

    /// `p_d'' + g e3` with its derivatives: the specific force that the reference motion needs.
    #[inline(always)]
    #[must_use]
    pub fn specific_force(&self) -> Jet<Vec3> {
        Jet::new(plus_gravity(self.acceleration_world), self.jerk_world, self.snap_world)
    }

    /// `b2d` with its derivatives.
    #[inline(always)]
    #[must_use]
    pub fn left(&self) -> Jet<Vec3> {
        Jet::new(self.left_world, self.left_rate_world, self.left_acceleration_world)
    }
}

/// `a + g e3`.
#[inline(always)]
fn plus_gravity(a: Vec3) -> Vec3 {
    Vec3::new(a.x, a.y, a.z + GRAVITY)
}
