//! Controller 2 alone.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use ctrl_core::config::SaturatedConfig;
use ctrl_core::controller::{StepOutput, TrackingController};
use ctrl_core::saturated::Saturated;
use step_image::{Input, fly, refuse};
use step_record::{Sample, Start};

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
    let Some(start) = input.record::<Start>() else { refuse() };
    let Ok(controller) = Saturated::new(&config) else { refuse() };
    let state = if start.resume == 0 {
        controller.initial_state()
    } else {
        controller.resume(&start.checkpoint).unwrap_or_else(|_| refuse())
    };
    fly(input, &controller, state, controller_step)
}
