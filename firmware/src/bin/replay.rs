//! The emulator's image for replay and processor in the loop: steps a scenario's controller for each
//! sample of a file or FIFO, see [`firmware::replay`].
//!
//! `emulate.sh replay scenario=paper-saturated input=PATH output=PATH`
#![no_std]
#![no_main]

use core::ffi::CStr;

use ctrl_core::controller::{AnyController, TrackingController};
use defmt_semihosting as _;
use firmware::evidence::kind_name;
use firmware::fault::take_evidence;
use firmware::replay::ReplaySample;
use firmware::scenario::Scenario;
use semihosting::fs::File;
use semihosting::io::{Read, Write};
use semihosting::{eprintln, process};
use stm32f4xx_hal as _;

/// Longest command line and path (bytes).
const TEXT: usize = 512;

#[cortex_m_rt::entry]
fn main() -> ! {
    if let Some(report) = take_evidence() {
        fail(kind_name(report.kind));
    }
    let Some(scenario) = argument("scenario=", Scenario::named) else {
        fail("scenario=NAME must name a scenario");
    };
    let Some(input) = argument("input=", |path| path_of(path, |path| File::open(path).ok())) else {
        fail("input=PATH must be a file to read");
    };
    let Some(output) = argument("output=", |path| path_of(path, |path| File::create(path).ok()))
    else {
        fail("output=PATH must be a file to write");
    };
    let Ok(document) = scenario.load() else { fail("the scenario is damaged") };
    let Ok(controller) = document.controller.build() else {
        fail("the controller refuses the scenario");
    };
    run(&controller, input, output);
    process::exit(0)
}

/// Steps until the input ends.
fn run(controller: &AnyController, mut input: File, mut output: File) {
    let mut state = controller.initial_state();
    let mut bytes = [0; ReplaySample::SIZE];
    while input.read_exact(&mut bytes).is_ok() {
        let reply =
            ReplaySample::decode(&bytes).and_then(|s| s.step(controller, &mut state).encode());
        if !reply.is_ok_and(|reply| output.write_all(&reply).is_ok()) {
            fail("the output takes no more");
        }
    }
}

/// Result of `parse` on the argument that begins with `key`.
fn argument<T>(key: &str, parse: impl Fn(&str) -> Option<T>) -> Option<T> {
    let arguments = semihosting::experimental::env::args::<TEXT>().ok()?;
    arguments.into_iter().flatten().find_map(|argument| parse(argument.strip_prefix(key)?))
}

/// Calls `open` with a path that ends in a zero.
fn path_of<T>(path: &str, open: impl Fn(&CStr) -> Option<T>) -> Option<T> {
    let mut bytes = [0; TEXT];
    bytes.get_mut(..path.len())?.copy_from_slice(path.as_bytes());
    open(CStr::from_bytes_until_nul(&bytes).ok()?)
}

fn fail(reason: &str) -> ! {
    eprintln!("replay: {reason}");
    process::exit(1)
}
