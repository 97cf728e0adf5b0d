//! One self-contained HTML page a campaign.

pub mod envelope;
pub mod failure_probability;
pub mod histogram;
pub mod points;
pub mod quantity;
pub mod tightest;
