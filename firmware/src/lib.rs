//! Flight software of the vehicle's microcontroller: the library behind the images in `main.rs`, `bin/`.
//!
//! Every decision is pure and tested on the host; all access to registers
//! is in `board` and exists for the target only.
#![no_std]

#[cfg(test)]
extern crate std;

pub mod evidence;
pub mod exchange;
pub mod flight_control;
pub mod ground_station;
mod literal;
pub mod navigation;
pub mod parameter_store;
pub mod pilot;
pub mod rate_loop;
pub mod rates;
pub mod reference_source;
pub mod remote_control;
pub mod replay;
pub mod rotor_output;
pub mod scenario;
pub mod sensor;
pub mod session;
pub mod state_sample;
pub mod stored_parameters;
pub mod stored_signing;
pub mod tick_source;
pub mod vehicle;

#[cfg(all(target_os = "none", feature = "image"))]
pub mod board;
#[cfg(all(target_os = "none", feature = "image"))]
pub mod event_log;
#[cfg(all(target_os = "none", feature = "image"))]
pub mod fault;
