//! Simulation of a vehicle under a controller of `ctrl-core`: plant, closed loop, scenarios, and the
//! monitors that check the guarantees of the two theorems against the plant's truth.
//!
//! A [`scenario`] is read from TOML; its flight runs in [`closed_loop`] against the [`plant`]; its
//! [`observer`]s receive every [`tick`], among them the monitors of the [`guarantee`]s. The table of
//! [`quantity`] defines each logged quantity of a tick. The crate `examples` shows a controller, a
//! disturbance, a monitor and a trajectory of one's own.

pub mod closed_loop;
pub mod evaluation;
mod exponential;
pub mod feedback;
pub mod guarantee;
mod lanes;
pub mod norm;
pub mod number;
pub mod observer;
pub mod per_axis;
pub mod plant;
pub mod quantity;
pub mod scenario;
pub mod sensor;
pub mod state_source;
pub mod tick;
