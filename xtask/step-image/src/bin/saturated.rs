//! Controller 2 alone.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use ctrl_core::config::SaturatedConfig;
use ctrl_core::controller::{StepOutput, TrackingController};
use ctrl_core::saturated::Saturated;
use step_image::{Input, fly, refuse};
use step_record::Sample;

#[unsafe(no_mangle)]
#[inline(never)]
fn controller_step(
    controller: &Saturated,
    state: &mut <Saturated as TrackingController>::State,
    sample: &Sample,
    output: &mut StepOutput,
) {
    *output = controller.step(state, &sample.vehicle, &sample.reference);
}

#[entry]
fn main() -> ! {
    let mut input = Input::open();
    let Some(config) = input.record::<SaturatedConfig>() else { refuse() };
    let Ok(controller) = Saturated::new(&config) else { refuse() };
    let state = controller.initial_state();
    fly(input, &controller, state, controller_step)
}
