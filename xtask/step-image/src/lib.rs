//! Flies one controller through recorded samples in the emulator, and measures around its step.
//!
//! Input and output are files of the host (semihosting), in the layout of `step-record`.
//! Nothing is known at compile time, so that the compiler cannot evaluate the step beforehand.
#![no_std]

#[cfg(feature = "c-interface")]
pub mod c_interface;
mod files;
mod stack;
mod timer;

use core::mem::size_of;
use core::panic::PanicInfo;

use cortex_m_semihosting::debug;
use ctrl_core::controller::{StepOutput, TrackingController};
use step_record::{Answer, Closing, Sample};

pub use files::{Input, Output};

/// The measured function: one step from a sample to its output.
pub type Step<C> = fn(&C, &mut <C as TrackingController>::State, &Sample, &mut StepOutput);

/// Gives up: the input was refused.
pub fn refuse() -> ! {
    debug::exit(debug::EXIT_FAILURE);
    cortex_m::asm::udf()
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    refuse()
}

/// Steps through the samples left in `input`, writes the answers, and ends the emulator.
pub fn fly<C: TrackingController>(
    mut input: Input,
    controller: &C,
    mut state: C::State,
    step: Step<C>,
) -> ! {
    // Without this the compiler may specialise the step for this one caller.
    let step = core::hint::black_box(step);
    let mut output = Output::create();
    let mut deepest = 0;
    timer::start();
    while let Some(sample) = input.record::<Sample>() {
        let mut result = StepOutput {
            wrench: Default::default(),
            torque_demand_body: Default::default(),
            status: Default::default(),
        };
        let paint = stack::Paint::below_here();
        let before = timer::ticks();
        step(controller, &mut state, &sample, &mut result);
        let ticks = timer::ticks().wrapping_sub(before);
        deepest = deepest.max(paint.depth());
        output.record(answer(&result, ticks));
    }
    output.record(Closing {
        stack: deepest,
        controller_size: size_of::<C>() as u32,
        state_size: size_of::<C::State>() as u32,
    });
    output.close();
    debug::exit(debug::EXIT_SUCCESS);
    cortex_m::asm::udf()
}

fn answer(result: &StepOutput, ticks: u32) -> Answer {
    let [x, y, z] = result.wrench.torque_body.to_array();
    Answer {
        wrench: [result.wrench.thrust, x, y, z].map(f32::to_bits),
        status: u32::from(result.status.bits()),
        ticks,
    }
}
