//! A controller behind the C interface, flown through the samples like any other.

use core::ptr::null_mut;

use ctrl_core::controller::{ControllerConfig, StepOutput, StepStatus, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, Wrench};
use gyrfalcon::code::GYRFALCON_OK;
use gyrfalcon::{GyrfalconController, GyrfalconOutput, gyrfalcon_configure, gyrfalcon_step};

use crate::{Input, fly, refuse};
use step_record::Sample;

/// The C interface as a controller: all of it is in the state, the caller's memory.
struct Interface;

impl TrackingController for Interface {
    type State = GyrfalconController;

    fn initial_state(&self) -> GyrfalconController {
        GyrfalconController::EMPTY
    }

    fn step(
        &self,
        state: &mut GyrfalconController,
        vehicle: &VehicleState,
        reference: &Reference,
    ) -> StepOutput {
        let mut output = GyrfalconOutput::empty();
        // SAFETY: all pointers are to values of their types.
        unsafe { gyrfalcon_step(state, &vehicle.into(), &reference.into(), &mut output) };
        StepOutput {
            wrench: Wrench { thrust: output.thrust, torque_body: output.torque_body.into() },
            torque_demand_body: output.torque_demand_body.into(),
            status: StepStatus::from_bits_truncate(output.status as u16),
        }
    }

    fn step_period(&self) -> f32 {
        0.0 // not asked for
    }
}

/// Conversion and call; what is measured is `gyrfalcon_step` in it.
fn step(
    interface: &Interface,
    state: &mut GyrfalconController,
    sample: &Sample,
    output: &mut StepOutput,
) {
    *output = interface.step(state, &sample.vehicle, &sample.reference);
}

/// Configures through the C interface and flies; refuses what that refuses.
pub fn fly_configured(input: Input, config: &ControllerConfig) -> ! {
    let mut controller = GyrfalconController::EMPTY;
    let size = size_of_val(&controller);
    // SAFETY: all pointers are to values of their types, or null.
    let result = unsafe { gyrfalcon_configure(&mut controller, size, &config.into(), null_mut()) };
    if result != GYRFALCON_OK {
        refuse();
    }
    fly(input, &Interface, controller, step)
}
