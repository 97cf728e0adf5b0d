//! Input validation of one controller step: finite, in range, a rotation, an acceleration within `M_p`.
//!
//! Checking every component first would cost a tenth of the step. So only the attitude is checked
//! beforehand; whatever else is not finite or out of range shows in the errors or in the results,
//! which are checked before anything is committed, and only then is the cause looked for.

use glam::{Mat3, Quat, Vec3};

use super::{Cascade, CascadeState, Evaluation};
use crate::controller::{StepOutput, StepStatus};
use crate::reference::Reference;
use crate::rotation::{brought_to_unit, renormalised};
use crate::saturation::clip;
use crate::vehicle::VehicleState;

/// Squares (SI units) of state, reference or errors that sum to more than this are nothing a vehicle
/// can follow: 1,000 km, 1,000 km/s. NaN and infinities do not compare as smaller either.
const SQUARE_MAX: f32 = 1e12;

/// Largest deviation of `|q|^2` from one without a flag in the status.
const UNIT_TOLERANCE: f32 = 0.02;

/// Input that a step may use.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Admitted<'a> {
    /// `q`, of unit length.
    pub attitude: Quat,
    /// `R(q)`.
    pub r: Mat3,
    /// The reference, its acceleration within `M_p`.
    pub reference: &'a Reference,
    /// Corrections that were made.
    pub status: StepStatus,
}

impl Cascade {
    /// Admits or corrects the input; `None` if the quaternion has no direction, or the reference
    /// acceleration exceeds `M_p` and the reference is out of range. A corrected reference is put in
    /// `clipped`.
    #[inline(always)]
    pub fn admit<'a>(
        &self,
        vehicle: &VehicleState,
        reference: &'a Reference,
        clipped: &'a mut Option<Reference>,
    ) -> Option<Admitted<'a>> {
        let q = vehicle.attitude;
        let (attitude, near) = brought_to_unit(q)?;
        let mut status = StepStatus::empty();
        if !near && (q.length_squared() - 1.0).abs() > UNIT_TOLERANCE {
            status |= StepStatus::ATTITUDE_RENORMALISED;
        }
        let reference = if self.within_bound(reference.acceleration_world) {
            reference
        } else {
            status |= StepStatus::REFERENCE_CLIPPED;
            if !in_range(reference) {
                return None;
            }
            clipped.insert(self.clipped(reference))
        };
        Some(Admitted { attitude, r: Mat3::from_quat(attitude), reference, status })
    }

    /// `true` if each component is within `M_p`.
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
    fn clipped(&self, reference: &Reference) -> Reference {
        let limit = self.reference_acceleration_max;
        let acceleration_world = clip(reference.acceleration_world, Vec3::splat(limit));
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
    /// `true` if all errors and `mu'` are in range and every result is finite; `step_4` is a sum of the results
    /// of step 4, so not finite if one of them is not.
    #[inline(always)]
    pub fn is_usable(&self, rate_error: Vec3, step_4: f32) -> bool {
        let square = rate_error.length_squared()
            + self.virtual_rate.mu_dot.length_squared()
            + self.force.error_square;
        let sum = self.force.thrust + self.force.inverse_mass_rate + step_4;
        square + 0.0 * sum < SQUARE_MAX // 0 times an infinity is NaN
    }
}

/// `true` if the reference is finite and in range. Evaluated only when its acceleration exceeds `M_p`
/// or the step gave no usable result.
#[cold]
#[inline(never)]
fn in_range(reference: &Reference) -> bool {
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
