//! Software-in-the-loop harness: flies the controllers of `ctrl-core` against a simulated vehicle.

pub mod closed_loop;
pub mod guarantee;
pub mod plant;
pub mod sample;
