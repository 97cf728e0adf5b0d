//! Flight-control laws for VTOL UAVs with unknown mass, unknown inertia, bounded disturbances and
//! input limits, after "Tracking Control of UAVs with Uncertainty and Input Constraints".
//!
//! Pure computation for host and microcontroller: no clock, no I/O, no allocation, fixed step,
//! `f32`, and the same bits everywhere. Equation numbers in parentheses are the paper's, as
//! corrected in `docs/theory.md`.
#![no_std]
#![deny(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod adaptation;
pub mod allocation;
mod cascade;
pub mod config;
pub mod controller;
pub mod error;
pub mod jet;
pub mod list;
pub mod mode;
pub mod reference;
pub mod robust_adaptive;
pub mod rotation;
pub mod saturated;
pub mod saturation;
pub mod sqrt;
pub mod trajectory;
pub mod vehicle;
