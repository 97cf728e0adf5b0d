//! No controller: what the other two images weigh more than this one is their controller.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use ctrl_core::config::RobustAdaptiveConfig;
use ctrl_core::controller::{
    Auxiliary, Estimates, Intermediates, StepOutput, StepStatus, TrackingController,
};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, Wrench, WrenchBounds};
use glam::{Quat, Vec3};
use step_image::{Input, fly, refuse};
use step_record::Sample;

struct Nothing(RobustAdaptiveConfig);

impl TrackingController for Nothing {
    type State = Auxiliary;

    fn initial_state(&self) -> Auxiliary {
        Auxiliary::REST
    }

    fn step_observed(
        &self,
        _: &mut Auxiliary,
        _: &VehicleState,
        _: &Reference,
        _: impl FnOnce(&Intermediates),
    ) -> StepOutput {
        StepOutput {
            wrench: Wrench::default(),
            torque_demand_body: Vec3::ZERO,
            status: StepStatus::empty(),
        }
    }

    fn step_period(&self) -> f32 {
        self.0.step_period
    }

    fn reference_acceleration_max(&self) -> f32 {
        self.0.reference_acceleration_max
    }

    fn bounds(&self) -> WrenchBounds {
        WrenchBounds { thrust_min: 0.0, thrust_max: 0.0, torque_max: 0.0 }
    }

    fn estimates(&self, _: &Auxiliary) -> Estimates {
        Estimates {
            inverse_mass: 0.0,
            inertia: Vec3::ZERO,
            inverse_inertia: Vec3::ZERO,
            gyroscopic_ratio: Vec3::ZERO,
        }
    }

    fn attitude_error(&self, _: &Auxiliary) -> Quat {
        Quat::IDENTITY
    }

    fn auxiliary(&self, state: &Auxiliary) -> Auxiliary {
        *state
    }
}

#[unsafe(no_mangle)]
#[inline(never)]
fn controller_step(
    controller: &Nothing,
    state: &mut Auxiliary,
    sample: &Sample,
    output: &mut StepOutput,
) {
    *output = controller.step(state, &sample.vehicle, &sample.reference);
}

#[entry]
fn main() -> ! {
    let mut input = Input::open();
    let Some(config) = input.record::<RobustAdaptiveConfig>() else { refuse() };
    fly(input, &Nothing(config), Auxiliary::REST, controller_step)
}
