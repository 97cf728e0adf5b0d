//! System tests across the crates, and what they measure against: an independent `f64`
//! transcription of the control laws, the golden steps, and one tolerance helper.

pub mod golden;
pub mod tolerance;
pub mod transcription;
