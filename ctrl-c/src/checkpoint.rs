//! Point of resumption: a vehicle starts with the estimates of its last flight.

use ctrl_core::config::Checkpoint;
use ctrl_core::controller::{
    AdaptiveController, AnyController, AnyControllerState, Auxiliary, LastingEstimates,
};
use ctrl_core::error::ConfigError;

use crate::access::{self, Sized32};
use crate::controller::{GyrfalconController, content, content_of};
use crate::refusal::{GyrfalconRefusal, refused};
use crate::result::{Failure, code_of};
use crate::types::{GyrfalconQuaternion, GyrfalconVector};

/// Estimates, the auxiliary system and the decay of the smoothing. What the controller does not have is
/// written as zero (the auxiliary attitude as identity) and not read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct GyrfalconCheckpoint {
    /// `sizeof(gyrfalcon_checkpoint)`.
    pub struct_size: u32,
    /// Time since the first step (s).
    pub elapsed: f32,
    /// Inverse mass (1/kg).
    pub inverse_mass: f32,
    /// Principal moments of inertia (kg m^2), controller 1.
    pub inertia: GyrfalconVector,
    /// Their inverses (1/(kg m^2)), controller 2.
    pub inverse_inertia: GyrfalconVector,
    /// Gyroscopic ratios (-), controller 2.
    pub gyroscopic_ratio: GyrfalconVector,
    /// Auxiliary attitude, controller 2.
    pub auxiliary_attitude: GyrfalconQuaternion,
    /// Auxiliary rate (rad/s), controller 2.
    pub auxiliary_rate: GyrfalconVector,
    /// Estimate of the lasting disturbance acceleration, horizontal (m/s^2).
    pub lasting_acceleration: GyrfalconVector,
    /// Estimate of the lasting disturbance torque (N m), controller 1.
    pub lasting_torque: GyrfalconVector,
    /// Its quotient by the moments of inertia (rad/s^2), controller 2.
    pub lasting_angular_acceleration: GyrfalconVector,
}

impl Sized32 for GyrfalconCheckpoint {}

impl From<&GyrfalconCheckpoint> for Checkpoint {
    fn from(checkpoint: &GyrfalconCheckpoint) -> Self {
        Self {
            elapsed: checkpoint.elapsed,
            inverse_mass: checkpoint.inverse_mass,
            inertia: checkpoint.inertia.into(),
            inverse_inertia: checkpoint.inverse_inertia.into(),
            gyroscopic_ratio: checkpoint.gyroscopic_ratio.into(),
            auxiliary: Auxiliary {
                attitude: checkpoint.auxiliary_attitude.into(),
                rate: checkpoint.auxiliary_rate.into(),
            },
            lasting: LastingEstimates {
                acceleration_world: checkpoint.lasting_acceleration.into(),
                torque_body: checkpoint.lasting_torque.into(),
                angular_acceleration_body: checkpoint.lasting_angular_acceleration.into(),
            },
        }
    }
}

/// The state of `controller` that goes on from `checkpoint`.
fn resumed(
    controller: &AnyController,
    checkpoint: &Checkpoint,
) -> Result<AnyControllerState, ConfigError> {
    Ok(match controller {
        AnyController::RobustAdaptive(controller) => {
            AnyControllerState::RobustAdaptive(controller.resume(checkpoint)?)
        }
        AnyController::Saturated(controller) => {
            AnyControllerState::Saturated(controller.resume(checkpoint)?)
        }
    })
}

/// Writes the controller's point of resumption, to be kept over a restart.
///
/// # Safety
/// Each pointer is null or points to a value of its type; none overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyrfalcon_get_checkpoint(
    controller: *const GyrfalconController,
    checkpoint: *mut GyrfalconCheckpoint,
) -> i32 {
    // SAFETY: the caller's promise.
    let both =
        unsafe { content_of(controller).and_then(|own| Ok((own, access::output(checkpoint)?))) };
    code_of(both.map(|(content, checkpoint)| {
        let estimates = content.controller.estimates(&content.state);
        let auxiliary = content.controller.auxiliary(&content.state);
        let lasting = content.controller.lasting(&content.state);
        *checkpoint = GyrfalconCheckpoint {
            struct_size: GyrfalconCheckpoint::SIZE,
            elapsed: content.elapsed(),
            inverse_mass: estimates.inverse_mass,
            inertia: estimates.inertia.into(),
            inverse_inertia: estimates.inverse_inertia.into(),
            gyroscopic_ratio: estimates.gyroscopic_ratio.into(),
            auxiliary_attitude: auxiliary.attitude.into(),
            auxiliary_rate: auxiliary.rate.into(),
            lasting_acceleration: lasting.acceleration_world.into(),
            lasting_torque: lasting.torque_body.into(),
            lasting_angular_acceleration: lasting.angular_acceleration_body.into(),
        };
    }))
}

/// Lets the controller go on from `checkpoint`. On `GYRFALCON_PARAMETER_REFUSED` `refusal`, unless it is
/// null, tells the field that is outside its set. After any failure the controller is as before.
///
/// # Safety
/// Each pointer is null or points to a value of its type; none overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gyrfalcon_resume(
    controller: *mut GyrfalconController,
    checkpoint: *const GyrfalconCheckpoint,
    refusal: *mut GyrfalconRefusal,
) -> i32 {
    // SAFETY: the caller's promise.
    code_of(unsafe { resume(controller, checkpoint, refusal) })
}

unsafe fn resume(
    controller: *mut GyrfalconController,
    checkpoint: *const GyrfalconCheckpoint,
    refusal: *mut GyrfalconRefusal,
) -> Result<(), Failure> {
    // SAFETY: the caller's promise.
    let (content, checkpoint, refusal) =
        unsafe { (content(controller)?, access::input(checkpoint)?, access::optional(refusal)?) };
    let state = resumed(&content.controller, &checkpoint.into())
        .map_err(|error| refused(&error, refusal))?;
    content.begin(state, checkpoint.elapsed);
    Ok(())
}
