//! Processor in the loop: the plant on the host, the controller in the firmware's image.
//!
//! The image runs in an [`emulator`] or on a board; a [`mod@line`] carries the link's bytes, the FIFOs of
//! [`lockstep`] or a serial port, and [`session`] its messages; [`set_up`] gives the vehicle a scenario,
//! and [`on_vehicle`] takes the controller's place in SIL's closed loop, tick by tick or with the host ahead. [`comparison`] compares every tick
//! with the law on the host. A [`recording`] keeps both byte streams of a flight, to [`replay`] them.

pub mod comparison;
pub mod cost;
pub mod emulator;
pub mod error;
pub mod fault;
pub mod flight;
mod flying_ahead;
pub mod line;
pub mod lockstep;
pub mod on_vehicle;
mod placement;
pub mod recording;
pub mod replay;
pub mod session;
pub mod set_up;

pub use error::PilError;
