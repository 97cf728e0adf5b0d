//! The filters of the body rate alone: samples that host and image both filter.
#![no_std]
#![no_main]

use core::mem::size_of;

use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
use ctrl_core::filter::{RateFilter, RateFilterState};
use glam::Vec3;
use step_image::{Output, refuse};
use step_record::Closing;
use step_record::filter::{FilterAnswer, STEP_PERIOD, filters, rates};

#[unsafe(no_mangle)]
#[inline(never)]
fn rate_filter_step(filter: &RateFilter, state: &mut RateFilterState, rate: &Vec3) -> Vec3 {
    filter.step(state, *rate)
}

#[entry]
fn main() -> ! {
    let mut output = Output::create();
    for (_, config) in core::hint::black_box(filters()) {
        let Ok(filter) = RateFilter::new(&config, core::hint::black_box(STEP_PERIOD)) else {
            refuse()
        };
        let mut state = filter.initial_state();
        for rate in rates() {
            let filtered = rate_filter_step(&filter, &mut state, &core::hint::black_box(rate));
            output.record(FilterAnswer::new(filtered));
        }
    }
    output.record(Closing {
        stack: 0,
        controller_size: size_of::<RateFilter>() as u32,
        state_size: size_of::<RateFilterState>() as u32,
    });
    output.close();
    debug::exit(debug::EXIT_SUCCESS);
    refuse()
}
