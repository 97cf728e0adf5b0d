//! Software-in-the-loop harness: flies the controllers of `ctrl-core` against a simulated vehicle.
//!
//! A [`scenario`] is read from TOML; its flight runs in [`closed_loop`] against the [`plant`];
//! every tick is a [`sample`] that observers see, among them the monitors of the [`guarantee`]s.
//! [`pil`] puts the firmware's image in the controller's place; a [`campaign`] flies a scenario many
//! times.

pub mod asset;
pub mod campaign;
pub mod cli;
pub mod figure;
pub mod log;
pub mod page;
pub mod pil;
pub mod progress;
pub mod replay3d;
pub mod report;
pub mod results;
pub mod run;
pub mod trace;
pub mod tune;
