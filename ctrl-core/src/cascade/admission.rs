//! What of the input a step may use: finite, in range, a rotation, an acceleration within `M_p`.

use glam::{Mat3, Quat, Vec3};

use super::Cascade;
use crate::controller::StepStatus;
use crate::reference::Reference;
use crate::rotation::renormalised;
use crate::vehicle::VehicleState;

/// A vehicle state whose squares of position [m], velocity [m/s] and body rate [rad/s] sum to more
/// than this is no state of a vehicle; NaN and infinities do not compare as smaller either.
const STATE_SQUARE_MAX: f32 = 1e14;

/// The same for the sum of all components of a reference.
const REFERENCE_SUM_MAX: f32 = 1e9;

/// How far `|q|^2` may be from one before the status says so.
const UNIT_TOLERANCE: f32 = 0.02;

/// The attitude of an admitted vehicle state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Admitted {
    /// `q`, of unit length.
    pub attitude: Quat,
    /// `R(q)`.
    pub r: Mat3,
    /// What had to be mended.
    pub status: StepStatus,
}

impl Cascade {
    /// Checks the input of one step; the error is the status that explains the refusal.
    #[inline(always)]
    pub fn admit(
        &self,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> Result<Admitted, StepStatus> {
        let square = vehicle.position_world.length_squared()
            + vehicle.velocity_world.length_squared()
            + vehicle.rate_body.length_squared();
        let q = vehicle.attitude;
        let attitude = renormalised(q).filter(|_| square < STATE_SQUARE_MAX);
        let Some(attitude) = attitude else {
            return Err(StepStatus::STATE_INVALID);
        };
        let in_range = sum(reference).abs() < REFERENCE_SUM_MAX; // false for NaN
        if !in_range {
            return Err(StepStatus::REFERENCE_INVALID);
        }
        let mut status = StepStatus::empty();
        if (q.length_squared() - 1.0).abs() > UNIT_TOLERANCE {
            status |= StepStatus::ATTITUDE_RENORMALISED;
        }
        if !self.within_bound(reference.acceleration_world) {
            status |= StepStatus::REFERENCE_CLIPPED;
        }
        Ok(Admitted { attitude, r: Mat3::from_quat(attitude), status })
    }

    /// Whether each component is within `M_p`.
    #[inline(always)]
    fn within_bound(&self, acceleration: Vec3) -> bool {
        let size = acceleration.abs();
        let limit = self.reference_acceleration_max;
        size.x <= limit && size.y <= limit && size.z <= limit
    }

    /// The reference with its acceleration clipped to `M_p`, so that (19) and (20) hold whatever
    /// the reference; its derivatives stay.
    #[cold]
    pub fn clipped(&self, reference: &Reference) -> Reference {
        let limit = self.reference_acceleration_max;
        Reference {
            acceleration_world: crate::saturation::clip(reference.acceleration_world, limit),
            ..*reference
        }
    }
}

/// Sum of all components.
#[inline(always)]
fn sum(reference: &Reference) -> f32 {
    let Reference {
        position_world,
        velocity_world,
        acceleration_world,
        jerk_world,
        snap_world,
        left_world,
        left_rate_world,
        left_acceleration_world,
    } = reference;
    let motion = (position_world + velocity_world) + (acceleration_world + jerk_world) + snap_world;
    let heading = (left_world + left_rate_world) + left_acceleration_world;
    (motion + heading).element_sum()
}
