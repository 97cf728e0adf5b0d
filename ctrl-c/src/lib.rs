//! C interface of both controllers, for firmware written in C or C++. The header
//! `include/gyrfalcon.h` is generated from these sources.
//!
//! ```text
//! gyrfalcon_configure -> gyrfalcon_step, gyrfalcon_step, ... -> gyrfalcon_get_checkpoint
//! ```
//!
//! The caller owns all memory: one [`GyrfalconController`] holds a validated controller and its state.
//! No function allocates, blocks, panics or unwinds; each returns a result code, and the step besides
//! it the status bits of the law. Units are SI; frames and rotations are those of
//! [`ctrl_core::rotation`]: world x east, y north, z up; body x forward, y left, z up.
//!
//! # What the caller owes
//!
//! Every pointer is null or points to a value of the type in the header, and no two of them overlap.
//! Null pointers, pointers that are not aligned, structs of another size or version, memory that was
//! not configured, and any bits in a number are answered with a result code.
#![no_std]
// Types carry their names in the header, constants the library's prefix.
#![allow(clippy::module_name_repetitions)]

#[cfg(test)]
extern crate std;

mod access;
mod checkpoint;
mod config;
mod controller;
mod flight;
mod refusal;
mod result;
mod types;

pub use checkpoint::{GyrfalconCheckpoint, gyrfalcon_get_checkpoint, gyrfalcon_resume};
pub use config::{
    GYRFALCON_ROBUST_ADAPTIVE, GYRFALCON_SATURATED, GyrfalconCascade, GyrfalconConfig,
    GyrfalconInitial, GyrfalconIntegral, GyrfalconRotors, GyrfalconUncertainty,
};
pub use controller::{
    GYRFALCON_CONTROLLER_SIZE, GYRFALCON_CONTROLLER_WORDS, GyrfalconController,
    gyrfalcon_abi_version, gyrfalcon_configure, gyrfalcon_controller_alignment,
    gyrfalcon_controller_size, gyrfalcon_reset,
};
pub use flight::{
    GyrfalconBounds, GyrfalconEstimates, GyrfalconOutput, gyrfalcon_face, gyrfalcon_get_bounds,
    gyrfalcon_get_estimates, gyrfalcon_hover, gyrfalcon_step, status,
};
pub use refusal::{GYRFALCON_NAME_SIZE, GyrfalconRefusal, bound};
pub use result::{GYRFALCON_ABI_VERSION, code, gyrfalcon_result_text};
pub use types::{
    GyrfalconInterval, GyrfalconQuaternion, GyrfalconReference, GyrfalconVector,
    GyrfalconVectorInterval, GyrfalconVehicleState,
};

#[cfg(feature = "static-library")]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
