//! Controller 1 behind the C interface.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use ctrl_core::config::RobustAdaptiveConfig;
use ctrl_core::controller::ControllerConfig;
use step_image::c_interface::fly_configured;
use step_image::{Input, refuse};

#[entry]
fn main() -> ! {
    let mut input = Input::open();
    let Some(config) = input.record::<RobustAdaptiveConfig>() else { refuse() };
    fly_configured(input, &ControllerConfig::RobustAdaptive(config))
}
