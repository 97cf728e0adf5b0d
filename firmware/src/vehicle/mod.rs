//! Supervision, link limits and rotors of the vehicle, from `vehicle.toml`.
//!
//! `build.rs` checks the file and turns it into Rust; the image reads it from the flash.

mod document;

pub use document::{LinkConfig, VehicleConfig};

use crate::literal::{Vec3, list, none};
use ctrl_core::allocation::{Rotor, RotorGeometry, Spin};
use ctrl_core::filter::RateFilterConfig;
#[allow(unused_imports, reason = "of a vehicle with filters")]
use ctrl_core::filter::{LowPassConfig, NotchConfig};
use ctrl_core::mode::safety::*;
use ctrl_core::mode::{FailsafePolicy, SupervisorConfig};
use ctrl_core::vehicle::Interval;

/// Number of rotors, as many as the boards have outputs.
pub const ROTORS: usize = 4;

/// The vehicle that this image flies; `build.rs` has checked it.
pub static VEHICLE: VehicleConfig = {
    use FailsafePolicy::*;
    #[allow(unused_imports, reason = "named where vehicle.toml has a [safety]")]
    use Reaction::*;
    use Spin::*;
    include!(concat!(env!("OUT_DIR"), "/vehicle.rs"))
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_static_is_the_file() {
        let text = include_str!("../../vehicle.toml");
        let number = |key: &str| -> f32 {
            let line = text.lines().find(|line| line.starts_with(key)).unwrap();
            line.split(['=', '#']).nth(1).unwrap().trim().parse().unwrap()
        };
        assert_eq!(VEHICLE.supervisor.arming_tilt_max, number("arming_tilt_max"));
        assert_eq!(VEHICLE.link.sample_valid as f32, number("sample_valid"));
        assert_eq!(VEHICLE.geometry.rotors.len(), text.matches("[[geometry.rotors]]").count());
    }
}
