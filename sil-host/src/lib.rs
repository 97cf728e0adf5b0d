//! Software-in-the-loop harness: flies the controllers of `ctrl-core` against a simulated vehicle.
//!
//! [`run`] flies scenarios of `sim` before every monitor and writes what they leave behind; [`pil`] puts
//! the firmware's image in the controller's place; a [`campaign`] flies a scenario many times.

pub mod asset;
pub mod campaign;
pub mod consistency;

pub mod figure;
pub mod fly;
pub mod log;
pub mod page;
pub mod pil;

pub mod replay3d;
pub mod report;
pub mod results;
pub mod run;
pub mod trace;
pub mod tune;
