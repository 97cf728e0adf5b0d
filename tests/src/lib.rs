//! System tests across the crates, and what they measure against: an independent `f64`
//! transcription of the control laws, the golden steps, random steps, flights of the simulated
//! vehicle, one tolerance helper, and the documented accuracy of the core.

pub mod accuracy;
#[cfg(doctest)]
mod documentation;
pub mod estimator_transcription;
pub mod flight;
pub mod golden;
pub mod grid;
pub mod paper_example;
pub mod random;
pub mod single_precision;
pub mod tolerance;
pub mod transcription;
