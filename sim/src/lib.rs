//! Simulation of a vehicle under a controller of `ctrl-core`: plant, closed loop, scenarios, and the
//! monitors that check the guarantees of the two theorems against the plant's truth.
//!
//! A [`scenario`] is read from TOML; its flight runs in [`closed_loop`] against the [`plant`]; every
//! [`tick`] goes to its observers, among them the monitors of the [`guarantee`]s.

pub mod closed_loop;
pub mod evaluation;
pub mod guarantee;
pub mod norm;
pub mod number;
pub mod observer;
pub mod plant;
pub mod quantity;
pub mod scenario;
pub mod tick;
