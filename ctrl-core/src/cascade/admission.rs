//! What of the input a step may use: finite, in range, a rotation, an acceleration within `M_p`.
//!
//! Checking every component first would cost a tenth of the step. So only the attitude is checked
//! beforehand; whatever else is not finite or out of range shows in the errors or in the results,
//! which are checked before anything is committed, and only then is the cause looked for.

use glam::{Mat3, Quat, Vec3};

use super::{Cascade, CascadeState, Evaluation};
use crate::controller::{StepOutput, StepStatus};
use crate::reference::Reference;
use crate::rotation::renormalised;
use crate::saturation::clip;
use crate::vehicle::VehicleState;

/// Squares (SI units) of state, reference or errors that sum to more than this are nothing a vehicle
/// can follow: 1,000 km, 1,000 km/s. NaN and infinities do not compare as smaller either.
const SQUARE_MAX: f32 = 1e12;

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
    /// The attitude to use and what had to be mended; `None` if the quaternion has no direction.
    #[inline(always)]
    pub fn admit(&self, vehicle: &VehicleState, reference: &Reference) -> Option<Admitted> {
        let q = vehicle.attitude;
        let attitude = renormalised(q)?;
        let mut status = StepStatus::empty();
        if (q.length_squared() - 1.0).abs() > UNIT_TOLERANCE {
            status |= StepStatus::ATTITUDE_RENORMALISED;
        }
        if !self.within_bound(reference.acceleration_world) {
            status |= StepStatus::REFERENCE_CLIPPED;
        }
        Some(Admitted { attitude, r: Mat3::from_quat(attitude), status })
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
    #[inline(never)]
    pub fn clipped(&self, reference: &Reference) -> Reference {
        let limit = self.reference_acceleration_max;
        let acceleration_world = clip(reference.acceleration_world, limit);
        Reference { acceleration_world, ..*reference }
    }

    /// A step without usable input or result: the last wrench again, and no estimate moves.
    #[cold]
    #[inline(never)]
    pub fn hold(
        &self,
        state: &mut CascadeState,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput {
        self.decay(state);
        let mut status = StepStatus::OUTPUT_HELD;
        let square = vehicle.position_world.length_squared()
            + vehicle.velocity_world.length_squared()
            + vehicle.rate_body.length_squared();
        let state_in_range = square < SQUARE_MAX && renormalised(vehicle.attitude).is_some();
        let reference_in_range = in_range(reference);
        status.set(StepStatus::STATE_INVALID, !state_in_range);
        status.set(StepStatus::REFERENCE_INVALID, !reference_in_range);
        status.set(StepStatus::RESULT_INVALID, state_in_range && reference_in_range);
        let wrench = state.wrench;
        StepOutput { wrench, torque_demand_body: wrench.torque_body, status }
    }
}

impl Evaluation {
    /// Whether all errors and `mu'` are in range and every result is finite; `step_4` is a sum of the results
    /// of step 4, so not finite if one of them is not.
    #[inline(always)]
    pub fn is_usable(&self, rate_error: Vec3, step_4: f32) -> bool {
        let square = self.force.position_error.length_squared()
            + self.force.velocity_error.length_squared()
            + rate_error.length_squared()
            + self.virtual_rate.mu_dot.length_squared();
        let sum = self.force.thrust + self.force.inverse_mass_rate + step_4;
        square + 0.0 * sum < SQUARE_MAX // 0 times an infinity is NaN
    }
}

/// Whether the reference is finite and in range. Looked at only when its acceleration exceeds `M_p`
/// or the step gave no usable result.
#[cold]
#[inline(never)]
pub(crate) fn in_range(reference: &Reference) -> bool {
    square_sum(reference) < SQUARE_MAX
}

/// Sum of the squares of all components.
fn square_sum(reference: &Reference) -> f32 {
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
    position_world.length_squared()
        + velocity_world.length_squared()
        + acceleration_world.length_squared()
        + jerk_world.length_squared()
        + snap_world.length_squared()
        + left_world.length_squared()
        + left_rate_world.length_squared()
        + left_acceleration_world.length_squared()
}
