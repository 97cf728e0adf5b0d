//! No controller: the other two images exceed this one by their controller.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use ctrl_core::config::RobustAdaptiveConfig;
use ctrl_core::controller::{Auxiliary, StepOutput, TrackingController};
use ctrl_core::reference::Reference;
use ctrl_core::vehicle::{VehicleState, Wrench};
use step_image::{Input, fly, refuse};
use step_record::Sample;

struct Nothing(RobustAdaptiveConfig);

impl TrackingController for Nothing {
    type State = Auxiliary;

    fn initial_state(&self) -> Auxiliary {
        Auxiliary::REST
    }

    fn step(&self, _: &mut Auxiliary, _: &VehicleState, _: &Reference) -> StepOutput {
        StepOutput::from(Wrench::default())
    }

    fn step_period(&self) -> f32 {
        self.0.step_period
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
