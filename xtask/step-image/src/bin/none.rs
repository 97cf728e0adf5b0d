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
use step_record::{Sample, Start};

struct Nothing(RobustAdaptiveConfig);

impl TrackingController for Nothing {
    type State = Start;

    fn initial_state(&self) -> Start {
        step_record::Record::zero()
    }

    fn step_observed(
        &self,
        _: &mut Start,
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

    fn estimates(&self, _: &Start) -> Estimates {
        Estimates {
            inverse_mass: 0.0,
            inertia: Vec3::ZERO,
            inverse_inertia: Vec3::ZERO,
            gyroscopic_ratio: Vec3::ZERO,
        }
    }

    fn attitude_error(&self, _: &Start) -> Quat {
        Quat::IDENTITY
    }

    fn auxiliary(&self, state: &Start) -> Auxiliary {
        state.checkpoint.auxiliary
    }
}

#[unsafe(no_mangle)]
#[inline(never)]
fn controller_step(
    controller: &Nothing,
    state: &mut Start,
    sample: &Sample,
    output: &mut StepOutput,
) {
    *output = controller.step(state, &sample.vehicle, &sample.reference);
}

#[entry]
fn main() -> ! {
    let mut input = Input::open();
    let Some(config) = input.record::<RobustAdaptiveConfig>() else { refuse() };
    let Some(start) = input.record::<Start>() else { refuse() };
    fly(input, &Nothing(config), start, controller_step)
}
