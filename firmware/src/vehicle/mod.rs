//! Supervision, link limits and rotors of the vehicle, from `vehicle.toml`.
//!
//! `build.rs` checks the file and turns it into postcard bytes, which the image carries.

mod document;

pub use document::{LinkConfig, VehicleConfig};

/// Number of rotors, as many as the boards have outputs.
pub const ROTORS: usize = 4;

/// The vehicle that this image flies.
///
/// # Errors
/// Only if the image is damaged: the bytes were written by the same code that reads them.
pub fn vehicle_config() -> Result<VehicleConfig, postcard::Error> {
    postcard::from_bytes(include_bytes!(concat!(env!("OUT_DIR"), "/vehicle.postcard")))
}
