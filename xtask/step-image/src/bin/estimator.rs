//! The estimator alone: predictions and corrections of a flight that host and image both compute.
#![no_std]
#![no_main]

use core::mem::size_of;

use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
use ctrl_core::estimator::{Estimator, EstimatorState, InertialSample, Measurement};
use step_image::{Output, refuse};
use step_record::Closing;
use step_record::estimator::{CONFIG, EstimatorAnswer, Event, Events, start};

#[unsafe(no_mangle)]
#[inline(never)]
fn estimator_predict(estimator: &Estimator, state: &mut EstimatorState, sample: &InertialSample) {
    estimator.predict(state, sample);
}

#[unsafe(no_mangle)]
#[inline(never)]
fn estimator_correct(
    estimator: &Estimator,
    state: &mut EstimatorState,
    measurement: &Measurement,
) -> bool {
    matches!(estimator.correct(state, measurement), ctrl_core::estimator::Verdict::Accepted { .. })
}

#[entry]
fn main() -> ! {
    let Ok(estimator) = Estimator::new(&core::hint::black_box(CONFIG)) else { refuse() };
    let mut state = estimator.start(&start());
    let mut output = Output::create();
    for event in Events::new() {
        match core::hint::black_box(event) {
            Event::Predict(sample) => estimator_predict(&estimator, &mut state, &sample),
            Event::Correct(measurement) => {
                if !estimator_correct(&estimator, &mut state, &measurement) {
                    refuse()
                }
            }
        }
        output.record(EstimatorAnswer::new(&state.vehicle(), state.gyro_bias()));
    }
    output.record(Closing {
        stack: 0,
        controller_size: size_of::<Estimator>() as u32,
        state_size: size_of::<EstimatorState>() as u32,
    });
    output.close();
    debug::exit(debug::EXIT_SUCCESS);
    refuse()
}
