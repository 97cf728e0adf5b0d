//! The step, and what can be asked of a controller in flight.

use ctrl_core::controller::{
    AdaptiveController, AnyController, AnyControllerState, StepOutput, StepStatus,
    TrackingController,
};
use ctrl_core::jet::Jet;
use ctrl_core::reference::Reference;
use glam::Vec3;

use crate::access::{self, Sized32};
use crate::controller::{GyrfalconController, content, content_of};
use crate::result::code::{GYRFALCON_NOT_CONFIGURED, GYRFALCON_OK, GYRFALCON_OUTPUT_HELD};
use crate::result::{Failure, code_of};
use crate::types::{GyrfalconReference, GyrfalconVector, GyrfalconVehicleState};

/// Bits of a step's status: limits that acted, and faults.
pub mod status {
    /// The wrench is the last one that was computed from good input (or the safe initial one).
    pub const GYRFALCON_STATUS_OUTPUT_HELD: u32 = 1;
    /// The vehicle state is not finite, out of range, or its quaternion has no direction.
    pub const GYRFALCON_STATUS_STATE_INVALID: u32 = 2;
    /// The reference is not finite or out of range.
    pub const GYRFALCON_STATUS_REFERENCE_INVALID: u32 = 4;
    /// The law gave a number that is not finite; nothing was committed.
    pub const GYRFALCON_STATUS_RESULT_INVALID: u32 = 8;
    /// The attitude quaternion was more than 1 % off unit length and has been normalised.
    pub const GYRFALCON_STATUS_ATTITUDE_RENORMALISED: u32 = 16;
    /// The reference acceleration exceeded its bound and has been clipped to it.
    pub const GYRFALCON_STATUS_REFERENCE_CLIPPED: u32 = 32;
    /// Thrust command and heading were nearly parallel; the last lateral axis was held.
    pub const GYRFALCON_STATUS_HEADING_HELD: u32 = 64;
    /// A component of the demanded torque exceeded its limit.
    pub const GYRFALCON_STATUS_TORQUE_SATURATED: u32 = 128;
    /// The mass estimate is on the border of its set.
    pub const GYRFALCON_STATUS_MASS_PROJECTED: u32 = 256;
    /// An inertia or gyroscopic estimate is on the border of its set.
    pub const GYRFALCON_STATUS_INERTIA_PROJECTED: u32 = 512;
    /// The sign of the attitude error was changed to turn the short way round.
    pub const GYRFALCON_STATUS_SIGN_FLIPPED: u32 = 1024;
    /// The auxiliary rate of controller 2 was clipped to what a step can integrate.
    pub const GYRFALCON_STATUS_AUXILIARY_CLIPPED: u32 = 2048;
    /// An estimate of the integral action is on the border of its set.
    pub const GYRFALCON_STATUS_LASTING_PROJECTED: u32 = 4096;
}

/// Result of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconOutput {
    /// `sizeof(gyrfalcon_output)`.
    pub struct_size: u32,
    /// Bits `GYRFALCON_STATUS_*`.
    pub status: u32,
    /// Collective thrust along body z (N).
    pub thrust: f32,
    /// Torque in body axes (N m).
    pub torque_body: GyrfalconVector,
    /// Torque before saturation (N m).
    pub torque_demand_body: GyrfalconVector,
}

/// Estimates of the unknown parameters; zero where the controller has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconEstimates {
    /// `sizeof(gyrfalcon_estimates)`.
    pub struct_size: u32,
    /// Inverse mass (1/kg).
    pub inverse_mass: f32,
    /// Principal moments of inertia (kg m^2), controller 1.
    pub inertia: GyrfalconVector,
    /// Their inverses (1/(kg m^2)), controller 2.
    pub inverse_inertia: GyrfalconVector,
    /// Gyroscopic ratios (-), controller 2.
    pub gyroscopic_ratio: GyrfalconVector,
}

/// The set in which every output lies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconBounds {
    /// `sizeof(gyrfalcon_bounds)`.
    pub struct_size: u32,
    /// Lower thrust bound (N), positive.
    pub thrust_min: f32,
    /// Upper thrust bound (N).
    pub thrust_max: f32,
    /// Bound of the torque about each body axis (N m); `FLT_MAX` for controller 1, which has none.
    pub torque_max: GyrfalconVector,
}

impl GyrfalconOutput {
    /// An output to be written by a step.
    #[must_use]
    pub fn empty() -> Self {
        Self { struct_size: Self::SIZE, ..Self::default() }
    }
}

impl Sized32 for GyrfalconOutput {}
impl Sized32 for GyrfalconEstimates {}
impl Sized32 for GyrfalconBounds {}

/// Evaluates the law at the current tick and advances the controller by one step period.
///
/// Bounded in time and total: after `GYRFALCON_OK` and `GYRFALCON_OUTPUT_HELD` the output is finite and
/// inside the controller's bounds, whatever numbers came in. After any other result the controller is
/// as before, and an output that can be written has zero thrust and torque and the status
/// `GYRFALCON_STATUS_OUTPUT_HELD`.
///
/// # Safety
/// Each pointer is null or points to a value of its type; none overlap.
#[unsafe(no_mangle)]
#[inline(never)]
pub unsafe extern "C" fn gyrfalcon_step(
    controller: *mut GyrfalconController,
    vehicle: *const GyrfalconVehicleState,
    reference: *const GyrfalconReference,
    output: *mut GyrfalconOutput,
) -> i32 {
    // SAFETY: the caller's promise.
    let output = match unsafe { access::output(output) } {
        Ok(output) => output,
        Err(Failure(code)) => return code,
    };
    // SAFETY: the caller's promise.
    match unsafe { step(controller, vehicle, reference) } {
        Ok(result) => {
            let held = result.status.contains(StepStatus::OUTPUT_HELD);
            output.status = u32::from(result.status.bits());
            output.thrust = result.wrench.thrust;
            output.torque_body = result.wrench.torque_body.into();
            output.torque_demand_body = result.torque_demand_body.into();
            if held { GYRFALCON_OUTPUT_HELD } else { GYRFALCON_OK }
        }
        Err(Failure(code)) => {
            let status = status::GYRFALCON_STATUS_OUTPUT_HELD;
            *output = GyrfalconOutput { status, ..GyrfalconOutput::empty() };
            code
        }
    }
}

#[inline(always)]
unsafe fn step(
    controller: *mut GyrfalconController,
    vehicle: *const GyrfalconVehicleState,
    reference: *const GyrfalconReference,
) -> Result<StepOutput, Failure> {
    // SAFETY: the caller's promise.
    let (content, vehicle, reference) =
        unsafe { (content(controller)?, access::input(vehicle)?, access::input(reference)?) };
    content.steps = content.steps.saturating_add(1);
    let (vehicle, reference) = (vehicle.as_core(), reference.as_core());
    // A state of the other kind cannot be: both are always written together.
    match (&content.controller, &mut content.state) {
        (AnyController::RobustAdaptive(law), AnyControllerState::RobustAdaptive(state)) => {
            Ok(law.step(state, vehicle, reference))
        }
        (AnyController::Saturated(law), AnyControllerState::Saturated(state)) => {
            Ok(law.step(state, vehicle, reference))
        }
        _ => Err(Failure(GYRFALCON_NOT_CONFIGURED)),
    }
}

/// Writes the current estimates.
///
/// # Safety
/// Each pointer is null or points to a value of its type; none overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyrfalcon_get_estimates(
    controller: *const GyrfalconController,
    estimates: *mut GyrfalconEstimates,
) -> i32 {
    // SAFETY: the caller's promise.
    let both =
        unsafe { content_of(controller).and_then(|own| Ok((own, access::output(estimates)?))) };
    code_of(both.map(|(content, estimates)| {
        let current = content.controller.estimates(&content.state);
        *estimates = GyrfalconEstimates {
            struct_size: GyrfalconEstimates::SIZE,
            inverse_mass: current.inverse_mass,
            inertia: current.inertia.into(),
            inverse_inertia: current.inverse_inertia.into(),
            gyroscopic_ratio: current.gyroscopic_ratio.into(),
        };
    }))
}

/// Writes the set in which every output lies.
///
/// # Safety
/// Each pointer is null or points to a value of its type; none overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyrfalcon_get_bounds(
    controller: *const GyrfalconController,
    bounds: *mut GyrfalconBounds,
) -> i32 {
    // SAFETY: the caller's promise.
    let both = unsafe { content_of(controller).and_then(|own| Ok((own, access::output(bounds)?))) };
    code_of(both.map(|(content, bounds)| {
        let own = content.controller.bounds();
        *bounds = GyrfalconBounds {
            struct_size: GyrfalconBounds::SIZE,
            thrust_min: own.thrust_min,
            thrust_max: own.thrust_max,
            torque_max: own.torque_max.into(),
        };
    }))
}

/// Writes the reference at rest in `position_world` (m), body x along world x.
///
/// # Safety
/// Each pointer is null or points to a value of its type; none overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyrfalcon_hover(
    reference: *mut GyrfalconReference,
    position_world: *const GyrfalconVector,
) -> i32 {
    // SAFETY: the caller's promise.
    let both = unsafe {
        access::output(reference).and_then(|own| Ok((own, access::plain(position_world)?)))
    };
    code_of(
        both.map(|(reference, position)| *reference = (&Reference::hover(position.into())).into()),
    )
}

/// Sets the heading of `reference` so that body x keeps as close to `forward`, a unit vector in the
/// horizontal plane with its derivatives (1/s, 1/s^2), as acceleration, jerk and snap allow.
///
/// # Safety
/// Each pointer is null or points to a value of its type; none overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyrfalcon_face(
    reference: *mut GyrfalconReference,
    forward: *const GyrfalconVector,
    forward_rate: *const GyrfalconVector,
    forward_acceleration: *const GyrfalconVector,
) -> i32 {
    // SAFETY: the caller's promise.
    let all = unsafe {
        access::output(reference).and_then(|reference| {
            let derivative = |pointer| Ok(Vec3::from(access::plain(pointer)?));
            let value = derivative(forward)?;
            let rate = derivative(forward_rate)?;
            Ok((reference, Jet::new(value, rate, derivative(forward_acceleration)?)))
        })
    };
    code_of(all.map(|(reference, forward)| {
        *reference = (&reference.as_core().facing(forward)).into();
    }))
}

#[cfg(test)]
mod tests {
    use super::status::*;
    use ctrl_core::controller::StepStatus;
    use std::assert_eq;

    #[test]
    fn status_bits_are_those_of_the_core() {
        let bits = [
            (GYRFALCON_STATUS_OUTPUT_HELD, StepStatus::OUTPUT_HELD),
            (GYRFALCON_STATUS_STATE_INVALID, StepStatus::STATE_INVALID),
            (GYRFALCON_STATUS_REFERENCE_INVALID, StepStatus::REFERENCE_INVALID),
            (GYRFALCON_STATUS_RESULT_INVALID, StepStatus::RESULT_INVALID),
            (GYRFALCON_STATUS_ATTITUDE_RENORMALISED, StepStatus::ATTITUDE_RENORMALISED),
            (GYRFALCON_STATUS_REFERENCE_CLIPPED, StepStatus::REFERENCE_CLIPPED),
            (GYRFALCON_STATUS_HEADING_HELD, StepStatus::HEADING_HELD),
            (GYRFALCON_STATUS_TORQUE_SATURATED, StepStatus::TORQUE_SATURATED),
            (GYRFALCON_STATUS_MASS_PROJECTED, StepStatus::MASS_PROJECTED),
            (GYRFALCON_STATUS_INERTIA_PROJECTED, StepStatus::INERTIA_PROJECTED),
            (GYRFALCON_STATUS_SIGN_FLIPPED, StepStatus::SIGN_FLIPPED),
            (GYRFALCON_STATUS_AUXILIARY_CLIPPED, StepStatus::AUXILIARY_CLIPPED),
            (GYRFALCON_STATUS_LASTING_PROJECTED, StepStatus::LASTING_PROJECTED),
        ];
        assert_eq!(bits.len(), StepStatus::all().iter().count());
        for (own, core) in bits {
            assert_eq!(own, u32::from(core.bits()), "{core:?}");
        }
    }
}
