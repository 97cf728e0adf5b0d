//! Controller 1 alone.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use ctrl_core::config::RobustAdaptiveConfig;
use ctrl_core::controller::{StepOutput, TrackingController};
use ctrl_core::robust_adaptive::RobustAdaptive;
use step_image::{Input, fly, refuse};
use step_record::Sample;

#[unsafe(no_mangle)]
#[inline(never)]
fn controller_step(
    controller: &RobustAdaptive,
    state: &mut <RobustAdaptive as TrackingController>::State,
    sample: &Sample,
    output: &mut StepOutput,
) {
    *output = controller.step(state, &sample.vehicle, &sample.reference);
}

#[entry]
fn main() -> ! {
    let mut input = Input::open();
    let Some(config) = input.record::<RobustAdaptiveConfig>() else { refuse() };
    let Ok(controller) = RobustAdaptive::new(&config) else { refuse() };
    let state = controller.initial_state();
    fly(input, &controller, state, controller_step)
}
